// Loops that one thread does alone or a team of threads shares.
#pragma once

#include <cstdint>

namespace qlb {

// Calls f(k) for each k < count. If `shared`, all threads of the team must call this, and wait for its end.
template <class F>
void for_each(bool shared, std::int64_t count, const F& f) {
  if (shared) {
#pragma omp for schedule(dynamic, 1)
    for (std::int64_t k = 0; k < count; ++k) f(k);
  } else {
    for (std::int64_t k = 0; k < count; ++k) f(k);
  }
}

// Calls f once; if `shared`, one thread of the team does, and the others wait.
template <class F>
void once(bool shared, const F& f) {
  if (shared) {
#pragma omp single
    f();
  } else {
    f();
  }
}

}  // namespace qlb
