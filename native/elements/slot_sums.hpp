// The second pass of every assembly: what the chunks have in their slots goes to the nodes or blocks.
#pragma once

#include "elements/tet_blocks.hpp"

namespace qlb {

// target[t, :] += scale * (sum of its slots), in the fixed order of the lists.
template <int N, int Stride = N>
void add_slots(const SlotLists& lists, const double* slots, double scale, double* target, int threads) {
  const auto targets = static_cast<std::int64_t>(lists.begin.size()) - 1;
#pragma omp parallel for schedule(static) num_threads(threads)
  for (std::int64_t t = 0; t < targets; ++t) {
    double sum[N] = {};
    for (std::int64_t k = lists.begin[t]; k < lists.begin[t + 1]; ++k) {
      const double* slot = slots + Stride * static_cast<std::int64_t>(lists.slot[k]);
      for (int i = 0; i < N; ++i) sum[i] += slot[i];
    }
    for (int i = 0; i < N; ++i) target[N * t + i] += scale * sum[i];
  }
}

}  // namespace qlb
