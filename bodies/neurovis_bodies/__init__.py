"""Bodies for networks: models of MuJoCo, environments of Gymnasium."""
