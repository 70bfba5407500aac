// Moving data between nodes in memory and SIMD lanes.
//
// Positions and gradients of a chunk have four doubles a node, so that a node is one aligned 32-byte access. For AVX2
// and AVX-512 the transposes between nodes and lanes are written out: hardware gathers and scalar sums cost twice.
#pragma once

#include <cstdint>
#include <xsimd/xsimd.hpp>

#include "simd/mat3.hpp"

namespace qlb {

inline constexpr int kLanes = 8;   // elements in a pack, whatever the SIMD level
inline constexpr int kPairs = 10;  // node pairs (a, b), a <= b, of a tetrahedron
inline constexpr int kStride = 4;  // doubles a node in the arrays of a chunk

// Positions (slots, kStride) of V::size nodes.
template <class V>
struct Gather {
  static Vec3<V> positions(const double* x, const std::int64_t* slots) {
    alignas(64) double buffer[3][V::size];
    for (std::size_t lane = 0; lane < V::size; ++lane)
      for (int c = 0; c < 3; ++c) buffer[c][lane] = x[kStride * slots[lane] + c];
    return {V::load_aligned(buffer[0]), V::load_aligned(buffer[1]), V::load_aligned(buffer[2])};
  }
};

// Sums into slots, lane after lane: two lanes may share a slot.
template <class V>
struct Scatter {
  // target (slots, kStride) += a 3-vector; the fourth entry is left alone.
  static void add_vector(const Vec3<V>& value, const std::int64_t* slots, double* target) {
    alignas(64) double buffer[3][V::size];
    for (int c = 0; c < 3; ++c) value[c].store_aligned(buffer[c]);
    for (std::size_t lane = 0; lane < V::size; ++lane)
      for (int c = 0; c < 3; ++c) target[kStride * slots[lane] + c] += buffer[c][lane];
  }

  // target (slots, 3, 3) += a matrix.
  static void add_matrix(const Mat3<V>& value, const std::int32_t* slots, double* target) {
    alignas(64) double buffer[9][V::size];
    for (int k = 0; k < 9; ++k) value(k / 3, k % 3).store_aligned(buffer[k]);
    for (std::size_t lane = 0; lane < V::size; ++lane) {
      double* out = target + 9 * static_cast<std::int64_t>(slots[lane]);
      for (int k = 0; k < 9; ++k) out[k] += buffer[k][lane];
    }
  }
};

#if defined(__AVX512F__)

template <>
struct Gather<xsimd::batch<double, xsimd::avx512f>> {
  using V = xsimd::batch<double, xsimd::avx512f>;
  static Vec3<V> positions(const double* x, const std::int64_t* slots) {
    const auto pair = [&](int low, int high) {
      const __m256d a = _mm256_load_pd(x + kStride * slots[low]), b = _mm256_load_pd(x + kStride * slots[high]);
      return _mm512_insertf64x4(_mm512_castpd256_pd512(a), b, 1);
    };
    const __m512d a = pair(0, 2), b = pair(1, 3), c = pair(4, 6), d = pair(5, 7);
    const __m512d xz_low = _mm512_unpacklo_pd(a, b), xz_high = _mm512_unpacklo_pd(c, d);
    const __m512d y_low = _mm512_unpackhi_pd(a, b), y_high = _mm512_unpackhi_pd(c, d);
    return {V(_mm512_shuffle_f64x2(xz_low, xz_high, 0x88)), V(_mm512_shuffle_f64x2(y_low, y_high, 0x88)),
            V(_mm512_shuffle_f64x2(xz_low, xz_high, 0xdd))};
  }
};

template <>
struct Scatter<xsimd::batch<double, xsimd::avx512f>> {
  using V = xsimd::batch<double, xsimd::avx512f>;

  static void add_vector(const Vec3<V>& value, const std::int64_t* slots, double* target) {
    const __m512d x = value[0], y = value[1], z = value[2], zero = _mm512_setzero_pd();
    const __m512d xy_even = _mm512_unpacklo_pd(x, y), xy_odd = _mm512_unpackhi_pd(x, y);
    const __m512d z_even = _mm512_unpacklo_pd(z, zero), z_odd = _mm512_unpackhi_pd(z, zero);
    const __m512i first = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
    const __m512i second = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
    const auto add = [&](int low, int high, __m512d two) {
      double *a = target + kStride * slots[low], *b = target + kStride * slots[high];
      _mm256_store_pd(a, _mm256_add_pd(_mm256_load_pd(a), _mm512_castpd512_pd256(two)));
      _mm256_store_pd(b, _mm256_add_pd(_mm256_load_pd(b), _mm512_extractf64x4_pd(two, 1)));
    };
    add(0, 2, _mm512_permutex2var_pd(xy_even, first, z_even));
    add(1, 3, _mm512_permutex2var_pd(xy_odd, first, z_odd));
    add(4, 6, _mm512_permutex2var_pd(xy_even, second, z_even));
    add(5, 7, _mm512_permutex2var_pd(xy_odd, second, z_odd));
  }

  // The first eight entries by an 8x8 transpose, the ninth by itself.
  static void add_matrix(const Mat3<V>& value, const std::int32_t* slots, double* target) {
    __m512d row[8], half[8], quarter[8];
    for (int k = 0; k < 8; k += 2) {
      row[k] = _mm512_unpacklo_pd(value(k / 3, k % 3), value((k + 1) / 3, (k + 1) % 3));
      row[k + 1] = _mm512_unpackhi_pd(value(k / 3, k % 3), value((k + 1) / 3, (k + 1) % 3));
    }
    for (int k = 0; k < 2; ++k) {  // 128-bit lanes of rows (0,1),(2,3) and (4,5),(6,7), even (k = 0) or odd lanes
      half[4 * k] = _mm512_shuffle_f64x2(row[k], row[2 + k], 0x88);
      half[4 * k + 1] = _mm512_shuffle_f64x2(row[k], row[2 + k], 0xdd);
      half[4 * k + 2] = _mm512_shuffle_f64x2(row[4 + k], row[6 + k], 0x88);
      half[4 * k + 3] = _mm512_shuffle_f64x2(row[4 + k], row[6 + k], 0xdd);
    }
    for (int k = 0; k < 2; ++k) {
      quarter[k] = _mm512_shuffle_f64x2(half[4 * k], half[4 * k + 2], 0x88);
      quarter[4 + k] = _mm512_shuffle_f64x2(half[4 * k], half[4 * k + 2], 0xdd);
      quarter[2 + k] = _mm512_shuffle_f64x2(half[4 * k + 1], half[4 * k + 3], 0x88);
      quarter[6 + k] = _mm512_shuffle_f64x2(half[4 * k + 1], half[4 * k + 3], 0xdd);
    }
    alignas(64) double ninth[8];
    value(2, 2).store_aligned(ninth);
    for (int lane = 0; lane < 8; ++lane) {
      double* out = target + 9 * static_cast<std::int64_t>(slots[lane]);
      _mm512_storeu_pd(out, _mm512_add_pd(_mm512_loadu_pd(out), quarter[lane]));
      out[8] += ninth[lane];
    }
  }
};

#endif

}  // namespace qlb
