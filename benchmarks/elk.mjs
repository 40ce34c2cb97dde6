// ELK's layered layout, for layout_peers.py. In, on standard input: a graph as ELK takes it. Out, on standard output:
// where everything is, and the milliseconds of the processor that the layout took, starting node aside.

import { readFileSync } from 'node:fs';
import ELK from 'elkjs/lib/elk.bundled.js';

const graph = JSON.parse(readFileSync(0, 'utf8'));
const elk = new ELK();
const begun = process.cpuUsage();
const drawn = await elk.layout(graph);
const { user, system } = process.cpuUsage(begun);
process.stdout.write(JSON.stringify({ drawn, milliseconds: (user + system) / 1000 }));
