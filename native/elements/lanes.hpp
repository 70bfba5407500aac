// Moving data between nodes in memory and SIMD lanes.
#pragma once

#include <cstdint>
#include <xsimd/xsimd.hpp>

#include "simd/mat3.hpp"

namespace qlb {

inline constexpr int kLanes = 8;   // elements in a pack, whatever the SIMD level
inline constexpr int kPairs = 10;  // node pairs (a, b), a <= b, of a tetrahedron

// Positions (slots, 4) of V::size nodes.
template <class V>
Vec3<V> gather(const double* positions, const std::int64_t* slots) {
  const auto index = xsimd::batch<std::int64_t, typename V::arch_type>::load_aligned(slots) << 2;
  return {V::gather(positions, index), V::gather(positions + 1, index), V::gather(positions + 2, index)};
}

// target[N slot + k] += values[k], lane after lane: two lanes may share a slot.
template <class V, int N, class Index>
void scatter_add(const V* values, const Index* slots, double* target) {
  alignas(64) double buffer[N][V::size];
  for (int k = 0; k < N; ++k) values[k].store_aligned(buffer[k]);
  for (std::size_t lane = 0; lane < V::size; ++lane) {
    double* out = target + N * static_cast<std::int64_t>(slots[lane]);
    for (int k = 0; k < N; ++k) out[k] += buffer[k][lane];
  }
}

}  // namespace qlb
