// What a deformation is like: its least change of volume, and how far the material at each node has turned.
#pragma once

#include "elements/element_loop.hpp"
#include "simd/polar3.hpp"

namespace qlb {

// The least J = det F of the elements; NaN where one is not a number.
template <class V>
double chunk_least_J(const ChunkData& chunk, const double* x, double* scratch) {
  load_positions(chunk, x, scratch);
  V least(std::numeric_limits<double>::infinity());
  for (std::int64_t pack = 0; pack < chunk.packs; ++pack)
    for (int lane = 0; lane < kLanes; lane += static_cast<int>(V::size)) {
      const V J = determinant(Tets<V>(chunk, pack, lane).deformation_gradient(scratch));
      least = xsimd::select((J < least) | !(J == J), J, least);  // NaN stays
    }
  alignas(64) double lanes[V::size];
  least.store_aligned(lanes);
  double result = lanes[0];
  for (std::size_t l = 1; l < V::size; ++l) result = lanes[l] < result || lanes[l] != lanes[l] ? lanes[l] : result;
  return result;
}

// slot_sums (slots, 3, 3), overwritten: sum of volume F(x) F(reference)^T over the elements at each slot.
// `scratch` holds 2 * kStride * slots doubles.
template <class V>
void chunk_correlations(const ChunkData& chunk, const double* x, const double* reference, double* scratch,
                        double* slot_sums) {
  double* reference_scratch = scratch + kStride * chunk.slots;
  load_positions(chunk, x, scratch);
  load_positions(chunk, reference, reference_scratch);
  set_zero(slot_sums, 9 * chunk.slots);
  for (std::int64_t pack = 0; pack < chunk.packs; ++pack)
    for (int lane = 0; lane < kLanes; lane += static_cast<int>(V::size)) {
      const Tets<V> tets(chunk, pack, lane);
      const Mat3<V> F = tets.deformation_gradient(scratch), G = tets.deformation_gradient(reference_scratch);
      Mat3<V> correlation;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          correlation(i, j) = tets.volume * (F(i, 0) * G(j, 0) + F(i, 1) * G(j, 1) + F(i, 2) * G(j, 2));
      for (int a = 0; a < 4; ++a) {
        std::int32_t slots[V::size];
        for (std::size_t l = 0; l < V::size; ++l) slots[l] = static_cast<std::int32_t>(tets.vertex[a * kLanes + l]);
        Scatter<V>::add_matrix(correlation, slots, slot_sums);
      }
    }
}

// The rotation nearest to each of `count` matrices (count, 3, 3), in place.
template <class V>
void nearest_rotations(double* matrices, std::int64_t count) {
  constexpr auto kWidth = static_cast<std::int64_t>(V::size);
  alignas(64) double buffer[9][V::size];
  for (std::int64_t first = 0; first < count; first += kWidth) {
    const std::int64_t lanes = count - first < kWidth ? count - first : kWidth;
    for (std::int64_t l = 0; l < kWidth; ++l)
      for (int k = 0; k < 9; ++k) buffer[k][l] = matrices[9 * (first + (l < lanes ? l : 0)) + k];
    Mat3<V> G;
    for (int k = 0; k < 9; ++k) G(k / 3, k % 3) = V::load_aligned(buffer[k]);
    const Mat3<V> R = nearest_rotation(G);
    for (int k = 0; k < 9; ++k) R(k / 3, k % 3).store_aligned(buffer[k]);
    for (std::int64_t l = 0; l < lanes; ++l)
      for (int k = 0; k < 9; ++k) matrices[9 * (first + l) + k] = buffer[k][l];
  }
}

}  // namespace qlb
