// Products of terms on few nodes with what NodeColumns keeps: kTermBlock terms at a time, side by side in memory.
#pragma once

#include "linalg/dense_columns.hpp"

namespace qlb::dense {

// out (length) = the sum of 3 `nodes` rows, each times its weight.
template <class V, int nodes, class T>
inline void combine_rows(const NodeTerm& term, const T* matrix, std::int64_t ld, std::int64_t length, T* out) {
  const T* from[nodes];
  V weight[3 * nodes];
#pragma GCC unroll 4
  for (int k = 0; k < nodes; ++k) from[k] = matrix + 3 * term.column[k] * ld;
#pragma GCC unroll 12
  for (int k = 0; k < 3 * nodes; ++k) weight[k] = V(static_cast<T>(term.u[k / 3][k % 3]));
  for (std::int64_t i = 0; i < length; i += kLanes<V>) {
    V sum(T(0));
#pragma GCC unroll 12
    for (int k = 0; k < 3 * nodes; ++k)
      sum = xsimd::fma(weight[k], V::load_unaligned(from[k / 3] + k % 3 * ld + i), sum);
    sum.store_unaligned(out + i);
  }
}

#if defined(__AVX512F__)
// to (16 x 16, row by row) = the transpose of from, whose rows are `ld` apart.
inline void transpose_sixteen(const float* from, std::int64_t ld, float* to) {
  constexpr int even = _MM_SHUFFLE(2, 0, 2, 0), odd = _MM_SHUFFLE(3, 1, 3, 1);
  __m512 a[16], b[16];
#pragma GCC unroll 16
  for (int k = 0; k < 16; ++k) a[k] = _mm512_loadu_ps(from + k * ld);
  // 4 x 4 blocks within each quarter, of rows 4 q to 4 q + 3
#pragma GCC unroll 4
  for (int q = 0; q < 16; q += 4) {
    const __m512 low01 = _mm512_unpacklo_ps(a[q], a[q + 1]), high01 = _mm512_unpackhi_ps(a[q], a[q + 1]);
    const __m512 low23 = _mm512_unpacklo_ps(a[q + 2], a[q + 3]), high23 = _mm512_unpackhi_ps(a[q + 2], a[q + 3]);
    b[q] = _mm512_shuffle_ps(low01, low23, _MM_SHUFFLE(1, 0, 1, 0));
    b[q + 1] = _mm512_shuffle_ps(low01, low23, _MM_SHUFFLE(3, 2, 3, 2));
    b[q + 2] = _mm512_shuffle_ps(high01, high23, _MM_SHUFFLE(1, 0, 1, 0));
    b[q + 3] = _mm512_shuffle_ps(high01, high23, _MM_SHUFFLE(3, 2, 3, 2));
  }
  // quarter p of b[4 q + c] goes to quarter q of row 4 p + c
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) {
    const __m512 even01 = _mm512_shuffle_f32x4(b[c], b[4 + c], even), odd01 = _mm512_shuffle_f32x4(b[c], b[4 + c], odd);
    const __m512 even23 = _mm512_shuffle_f32x4(b[8 + c], b[12 + c], even);
    const __m512 odd23 = _mm512_shuffle_f32x4(b[8 + c], b[12 + c], odd);
    _mm512_storeu_ps(to + 16 * c, _mm512_shuffle_f32x4(even01, even23, even));
    _mm512_storeu_ps(to + 16 * (4 + c), _mm512_shuffle_f32x4(odd01, odd23, even));
    _mm512_storeu_ps(to + 16 * (8 + c), _mm512_shuffle_f32x4(even01, even23, odd));
    _mm512_storeu_ps(to + 16 * (12 + c), _mm512_shuffle_f32x4(odd01, odd23, odd));
  }
}
#endif

// out (length, kTermBlock) = the transpose of rows (kTermBlock, length); length in multiples of kTermBlock.
template <class V, class T>
inline void interleave(const T* rows, std::int64_t length, T* out) {
  for (std::int64_t i = 0; i < length; i += kTermBlock) {
#if defined(__AVX512F__)
    if constexpr (kLanes<V> == 16) {
      transpose_sixteen(rows + i, length, out + kTermBlock * i);
      continue;
    }
#endif
    for (int k = 0; k < kTermBlock; ++k)
      for (int m = 0; m < kTermBlock; ++m) out[kTermBlock * (i + k) + m] = rows[m * length + i + k];
  }
}

// As DenseKernels says.
template <class V, class T>
void multiply_terms(const NodeTerm* const* terms, int count, const T* matrix, std::int64_t ld, std::int64_t length,
                    T* work, T* out) {
  for (int k = 0; k < count; ++k) {
    T* row = work + k * length;
    switch (terms[k]->count) {
      case 1:
        combine_rows<V, 1>(*terms[k], matrix, ld, length, row);
        break;
      case 2:
        combine_rows<V, 2>(*terms[k], matrix, ld, length, row);
        break;
      case 3:
        combine_rows<V, 3>(*terms[k], matrix, ld, length, row);
        break;
      default:
        combine_rows<V, 4>(*terms[k], matrix, ld, length, row);
    }
  }
  interleave<V>(work, length, out);
}

template <class V, class T>
void dot_terms(const NodeTerm& term, const T* products, double* sums) {
  using D = xsimd::batch<double, typename V::arch_type>;
  constexpr int vectors = kTermBlock / kLanes<D>;
  D sum[vectors];
#pragma GCC unroll 8
  for (int v = 0; v < vectors; ++v) sum[v] = D(0.0);
  for (int k = 0; k < term.count; ++k)
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) {
      const T* from = products + kTermBlock * (3 * std::int64_t{term.column[k]} + c);
      const D weight(term.u[k][c]);
#pragma GCC unroll 8
      for (int v = 0; v < vectors; ++v) sum[v] = xsimd::fma(weight, load_doubles<D>(from + v * kLanes<D>), sum[v]);
    }
#pragma GCC unroll 8
  for (int v = 0; v < vectors; ++v) sum[v].store_unaligned(sums + v * kLanes<D>);
}

}  // namespace qlb::dense
