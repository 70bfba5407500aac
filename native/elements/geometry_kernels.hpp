// What a deformation is like: its least change of volume, and how the material at each node has moved.
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

// volume A B^T
template <class V>
Mat3<V> times_transpose(const Mat3<V>& A, const Mat3<V>& B, const V& volume) {
  Mat3<V> C;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C(i, j) = volume * (A(i, 0) * B(j, 0) + A(i, 1) * B(j, 1) + A(i, 2) * B(j, 2));
  return C;
}

// slot_sums (slots, 3, 3), overwritten: sums of volume F(x) F(reference)^T over the elements at each slot.
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
      const Mat3<V> sum = times_transpose(tets.deformation_gradient(scratch),
                                          tets.deformation_gradient(reference_scratch), tets.volume);
      for (int a = 0; a < 4; ++a) {
        std::int32_t slots[V::size];
        for (std::size_t l = 0; l < V::size; ++l) slots[l] = static_cast<std::int32_t>(tets.vertex[a * kLanes + l]);
        Scatter<V>::add_matrix(sum, slots, slot_sums);
      }
    }
}

// T = (1 - weight) R + weight A for each C of `maps` (count, 3, 3) and S of `reference` (count, 3, 3): A = C S^-1 the
// affine map that takes the reference to x with the least error, R the rotation nearest to C. T is written over C.
template <class V>
void nodal_maps(double* maps, const double* reference, std::int64_t count, double weight) {
  constexpr auto kWidth = static_cast<std::int64_t>(V::size);
  alignas(64) double buffer[18][V::size];
  for (std::int64_t first = 0; first < count; first += kWidth) {
    const std::int64_t lanes = count - first < kWidth ? count - first : kWidth;
    for (std::int64_t l = 0; l < kWidth; ++l)
      for (int k = 0; k < 9; ++k) {
        const std::int64_t from = 9 * (first + (l < lanes ? l : 0)) + k;
        buffer[k][l] = maps[from];
        buffer[9 + k][l] = reference[from];
      }
    Mat3<V> C, S;
    for (int k = 0; k < 9; ++k) {
      C(k / 3, k % 3) = V::load_aligned(buffer[k]);
      S(k / 3, k % 3) = V::load_aligned(buffer[9 + k]);
    }
    const Mat3<V> cof = cofactor(S), A = C * cof;  // S is symmetric: S^-1 = cof S / det S
    const V scale = V(weight) / dot(column(S, 0), column(cof, 0));
    const Mat3<V> R = nearest_rotation(C);
    for (int k = 0; k < 9; ++k) (V(1.0 - weight) * R(k / 3, k % 3) + scale * A(k / 3, k % 3)).store_aligned(buffer[k]);
    for (std::int64_t l = 0; l < lanes; ++l)
      for (int k = 0; k < 9; ++k) maps[9 * (first + l) + k] = buffer[k][l];
  }
}

}  // namespace qlb
