// Matches core/hash.h on the CPU.

// Mixes the bits of a number.
uint mixed(uint x) {
  x = (x ^ (x >> 16)) * 0x7FEB352Du;
  x = (x ^ (x >> 15)) * 0x846CA68Bu;
  return x ^ (x >> 16);
}
uint hash_of(uint a, uint b) {
  return mixed(a * 0x9E3779B9u + b * 0x85EBCA6Bu + 0x27D4EB2Fu);
}
