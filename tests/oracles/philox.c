/* Philox4x32-10 by hand: an oracle for the draws. Reads lines of six numbers, the four words of a counter and the two of
 * a key, and prints the four words of the block. */
#include <inttypes.h>
#include <stdio.h>

int main(void) {
  uint32_t c[4], k[2];
  while (scanf("%" SCNu32 " %" SCNu32 " %" SCNu32 " %" SCNu32 " %" SCNu32 " %" SCNu32, &c[0], &c[1], &c[2], &c[3], &k[0],
               &k[1]) == 6) {
    for (int round = 0; round < 10; round++) {
      const uint64_t p0 = (uint64_t)0xD2511F53u * c[0], p1 = (uint64_t)0xCD9E8D57u * c[2];
      const uint32_t n0 = (uint32_t)(p1 >> 32) ^ c[1] ^ k[0], n2 = (uint32_t)(p0 >> 32) ^ c[3] ^ k[1];
      c[0] = n0;
      c[1] = (uint32_t)p1;
      c[2] = n2;
      c[3] = (uint32_t)p0;
      k[0] += 0x9E3779B9u;
      k[1] += 0xBB67AE85u;
    }
    printf("%" PRIu32 " %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", c[0], c[1], c[2], c[3]);
  }
  return 0;
}
