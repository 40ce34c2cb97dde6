/**
 * Links of a skeleton: two points and a radius in metres, then further points, by pairs.
 */

/** The points of a link: the ends of its line, then of those beside it. @param {number[]} link @returns {number[]} */
export function endsOf([start, end, , ...beside]) {
  return [start, end, ...beside];
}

/** The links that meet at a point. @param {number[][]} links @param {number} point @returns {number[][]} */
export function meeting(links, point) {
  return links.filter((link) => endsOf(link).includes(point));
}

/** How thick what meets at a point is, in metres. @param {number[][]} links @param {number} point @returns {number} */
export function thickness(links, point) {
  return Math.max(0, ...meeting(links, point).map((link) => link[2]));
}
