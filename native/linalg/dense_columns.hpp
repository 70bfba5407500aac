// Products of a node's three columns (NodeColumns). Of floats they are summed in double, at least from part to part.
#pragma once

#include "linalg/dense_solve.hpp"

namespace qlb::dense {

// As many doubles as one of V's vectors of doubles holds, from floats or doubles.
template <class D>
inline D load_doubles(const double* from) {
  return D::load_unaligned(from);
}
template <class D>
inline D load_doubles(const float* from) {
#if defined(__AVX512F__)
  return D(_mm512_cvtps_pd(_mm256_loadu_ps(from)));
#elif defined(__AVX2__)
  return D(_mm256_cvtps_pd(_mm_loadu_ps(from)));
#else
  alignas(64) double buffer[kLanes<D>];
  for (int k = 0; k < kLanes<D>; ++k) buffer[k] = from[k];
  return D::load_aligned(buffer);
#endif
}

#if defined(__AVX512F__)
// The sum of the lanes of v[i] at 4 (i mod 4) + i/4. Of AVX-512 the foundation alone; xsimd's haddp takes more.
inline __m512 sums_of_sixteen(const __m512 (&v)[16]) {
  constexpr int low = _MM_SHUFFLE(1, 0, 1, 0), high = _MM_SHUFFLE(3, 2, 3, 2);
  constexpr int even = _MM_SHUFFLE(2, 0, 2, 0), odd = _MM_SHUFFLE(3, 1, 3, 1);
  __m512 half[8], quarter[4], eighth[2];
#pragma GCC unroll 8
  for (int k = 0; k < 8; ++k)
    half[k] = _mm512_add_ps(_mm512_shuffle_f32x4(v[2 * k], v[2 * k + 1], low),
                            _mm512_shuffle_f32x4(v[2 * k], v[2 * k + 1], high));
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k)
    quarter[k] = _mm512_add_ps(_mm512_shuffle_f32x4(half[2 * k], half[2 * k + 1], even),
                               _mm512_shuffle_f32x4(half[2 * k], half[2 * k + 1], odd));
#pragma GCC unroll 2
  for (int k = 0; k < 2; ++k)
    eighth[k] = _mm512_add_ps(_mm512_shuffle_ps(quarter[2 * k], quarter[2 * k + 1], even),
                              _mm512_shuffle_ps(quarter[2 * k], quarter[2 * k + 1], odd));
  return _mm512_add_ps(_mm512_shuffle_ps(eighth[0], eighth[1], even), _mm512_shuffle_ps(eighth[0], eighth[1], odd));
}
#endif

// to += the sums of the lanes of nine vectors, always in the same way.
template <class V, class T>
inline void add_lane_sums(const V (&v)[9], double* to) {
#if defined(__AVX512F__)
  if constexpr (kLanes<V> == 16) {
    const __m512 zero = _mm512_setzero_ps();
    alignas(64) float sums[16];
    _mm512_store_ps(sums, sums_of_sixteen({v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], zero, zero, zero, zero,
                                           zero, zero, zero}));
    for (int k = 0; k < 9; ++k) to[k] += sums[4 * (k % 4) + k / 4];
    return;
  }
#endif
  for (int k = 0; k < 9; ++k) to[k] += sum_of_lanes<V, T>(v[k]);
}

// The last `count` (0 to lanes) entries of a vector; the rest is zero.
template <class V, class T>
inline V load_last(const T* from, int count) {
#if defined(__AVX512F__)
  if constexpr (sizeof(V) == 64 && sizeof(T) == 8)
    return V(_mm512_maskz_load_pd(static_cast<__mmask8>(0xffu << (8 - count)), from));
  else if constexpr (sizeof(V) == 64)
    return V(_mm512_maskz_load_ps(static_cast<__mmask16>(0xffffu << (16 - count)), from));
#endif
  alignas(64) T buffer[kLanes<V>] = {};
  for (int i = kLanes<V> - count; i < kLanes<V>; ++i) buffer[i] = from[i];
  return V::load_aligned(buffer);
}

// As gram3 below, for A of `nodes` nodes; a node's result does not depend on which others there are.
template <class V, int nodes, class T>
inline void gram_of(const T* const* a, const std::int64_t* lda, const T* b, std::int64_t ldb, std::int64_t rows,
                    double* g) {
  constexpr std::int64_t kPart = 64 * kLanes<V>;
  for (int k = 0; k < 9 * nodes; ++k) g[k] = 0.0;
  const std::int64_t whole = (rows + kLanes<V> - 1) / kLanes<V> * kLanes<V>;
  for (std::int64_t first = -whole; first < 0; first += kPart) {
    const std::int64_t last = -first < kPart ? 0 : first + kPart;
    V sum[nodes][9];
    const auto add = [&](std::int64_t i, const V& y0, const V& y1, const V& y2) {
#pragma GCC unroll 6
      for (int k = 0; k < 3 * nodes; ++k) {
        const int m = k / 3, c = k % 3;
        const V x = V::load_aligned(a[m] + i + c * lda[m]);
        sum[m][3 * c] = xsimd::fma(x, y0, sum[m][3 * c]);
        sum[m][3 * c + 1] = xsimd::fma(x, y1, sum[m][3 * c + 1]);
        sum[m][3 * c + 2] = xsimd::fma(x, y2, sum[m][3 * c + 2]);
      }
    };
#pragma GCC unroll 18
    for (int k = 0; k < 9 * nodes; ++k) sum[k / 9][k % 9] = V(T(0));
    std::int64_t i = first;
    if (const auto part = static_cast<int>(rows + first + kLanes<V>); part < kLanes<V>) {
      const T* y = b + i;
      add(i, load_last<V>(y, part), load_last<V>(y + ldb, part), load_last<V>(y + 2 * ldb, part));
      i += kLanes<V>;
    }
    for (; i < last; i += kLanes<V>) {
      const T* y = b + i;
      add(i, V::load_aligned(y), V::load_aligned(y + ldb), V::load_aligned(y + 2 * ldb));
    }
#pragma GCC unroll 2
    for (int m = 0; m < nodes; ++m) add_lane_sums<V, T>(sum[m], g + 9 * m);
  }
}

// As DenseKernels says. Summed in T over kPart rows, then in double.
template <class V, class T>
void gram3(const T* const* a, const std::int64_t* lda, int few, const T* b, std::int64_t ldb, std::int64_t rows,
           double* g) {
  int m = 0;
  if constexpr (kManyRegisters<V>)
    for (; m + 2 <= few; m += 2) gram_of<V, 2>(a + m, lda + m, b, ldb, rows, g + 9 * m);
  for (; m < few; ++m) gram_of<V, 1>(a + m, lda + m, b, ldb, rows, g + 9 * m);
}

// t (3) += A^T y.
template <class V, class T>
void dots3(const T* a, std::int64_t lda, const T* y, std::int64_t rows, double* t) {
  using D = xsimd::batch<double, typename V::arch_type>;
  D sum[3] = {D(0.0), D(0.0), D(0.0)};
  std::int64_t i = 0;
  for (; i + kLanes<D> <= rows; i += kLanes<D>) {
    const D side = load_doubles<D>(y + i);
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) sum[c] = xsimd::fma(load_doubles<D>(a + i + c * lda), side, sum[c]);
  }
  for (int c = 0; c < 3; ++c) {
    double rest = 0.0;
    for (std::int64_t k = i; k < rows; ++k) rest += static_cast<double>(a[k + c * lda]) * y[k];
    t[c] += sum_of_lanes<D, double>(sum[c]) + rest;
  }
}

// y -= A c.
template <class V, class T>
void subtract3(const T* a, std::int64_t lda, const double* c, T* y, std::int64_t rows) {
  const V c0(static_cast<T>(-c[0])), c1(static_cast<T>(-c[1])), c2(static_cast<T>(-c[2]));
  const auto changed = [&](V v, std::int64_t i, const auto& load) {
    v = xsimd::fma(load(a + i), c0, v);
    v = xsimd::fma(load(a + i + lda), c1, v);
    return xsimd::fma(load(a + i + 2 * lda), c2, v);
  };
  std::int64_t i = 0;
  for (; i + kLanes<V> <= rows; i += kLanes<V>)
    changed(V::load_unaligned(y + i), i, [](const T* p) { return V::load_unaligned(p); }).store_unaligned(y + i);
  if (const int rest = static_cast<int>(rows - i); rest > 0)
    store_part<V>(changed(load_part<V>(y + i, rest), i, [&](const T* p) { return load_part<V>(p, rest); }), y + i,
                  rest);
}

}  // namespace qlb::dense
