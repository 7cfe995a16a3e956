#include <cstdio>
int main() { std::puts("quoin"); }
