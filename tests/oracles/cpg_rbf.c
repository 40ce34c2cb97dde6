/* Use case 1 by hand, from Eqs. 6-10 of the paper alone: an oracle that shares nothing with the compiler.
 * Reads the eight centres (first all of C1, then all of C2) from standard input, and prints a line a step:
 * C1 C2 K1..K8 O T, then the eight weights before the step's update. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
  const double alpha = 1.0094, phi = 0.049, sigma = 40, eta = 0.01, period = 128.62;
  const double pi = 3.14159265358979323846;
  double centre[2][8], c[2] = {0.1, 0.0}, w[8] = {0};
  const long steps = argc > 1 ? strtol(argv[1], NULL, 10) : 12000;
  for (int axis = 0; axis < 2; axis++)
    for (int i = 0; i < 8; i++)
      if (scanf("%lf", &centre[axis][i]) != 1) return 1;
  for (long t = 0; t < steps; t++) {
    double k[8], o = 0;
    for (int i = 0; i < 8; i++) {
      const double x = c[0] - centre[0][i], y = c[1] - centre[1][i];
      k[i] = exp(-sigma * (x * x + y * y)); /* Eq. 8 */
      o += w[i] * k[i];                     /* Eq. 9 */
    }
    const double turn = 2 * pi * (t + 24) / period, target = 0.5 * sin(turn) + 0.2 * sin(2 * turn);
    printf("%.17g %.17g", c[0], c[1]);
    for (int i = 0; i < 8; i++) printf(" %.17g", k[i]);
    printf(" %.17g %.17g", o, target);
    for (int i = 0; i < 8; i++) printf(" %.17g", w[i]);
    printf("\n");
    for (int i = 0; i < 8; i++) w[i] += eta * k[i] * (target - o); /* Eq. 10 */
    const double c1 = tanh(alpha * cos(phi) * c[0] + alpha * sin(phi) * c[1]); /* Eq. 6 */
    const double c2 = tanh(-alpha * sin(phi) * c[0] + alpha * cos(phi) * c[1]); /* Eq. 7 */
    c[0] = c1;
    c[1] = c2;
  }
  return 0;
}
