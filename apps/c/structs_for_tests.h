#pragma once

#include "quoin.h"

/// What QUOIN_INIT is in C.
template <class T>
T sized() {
  T made{};
  made.size = sizeof made;
  return made;
}
