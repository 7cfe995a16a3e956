// Finding the places of bits, one by one. Included within a namespace.

std::uint16_t* append_places(std::uint64_t bits, int first_place, std::uint16_t* end) {
  for (; bits != 0; bits &= bits - 1) *end++ = static_cast<std::uint16_t>(first_place + std::countr_zero(bits));
  return end;
}

std::uint16_t* append_edges(std::uint64_t bits, std::uint64_t solid, int first_place, std::uint16_t* end) {
  for (; bits != 0; bits &= bits - 1) {
    const int x = std::countr_zero(bits);
    *end++ = static_cast<std::uint16_t>((first_place + x) | static_cast<int>(solid >> x & 1U) << 15);
  }
  return end;
}
