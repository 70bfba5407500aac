// Loops that one thread does alone or a team of threads shares.
#pragma once

#include <algorithm>
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

// Calls f(item, shared) for one item after the other of [item, end), by a team whose threads all call this: shared by
// all where worth(item), else by one thread for each run of such items. Ends at the first item for which stop(item)
// holds.
template <class Item, class Worth, class F, class Stop>
void one_by_one(Item item, Item end, const Worth& worth, const F& f, const Stop& stop) {
  while (item != end && !stop(*item)) {
    if (worth(*item)) {
      f(*item++, true);
      continue;
    }
    const auto last = std::find_if(item, end, worth);
#pragma omp barrier  // nothing may change stop(item) before all have asked
    once(true, [&] {
      for (auto k = item; k != last && !stop(*k); ++k) f(*k, false);
    });
    item = last;
  }
}

}  // namespace qlb
