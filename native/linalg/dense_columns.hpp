// Products of a node's three columns (NodeColumns). Products of floats are summed in double.
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

// g (3 x 3, row by row) = A^T B, A and B (rows x 3), with kPadding zeros below each column. Summed in T over kPart
// rows, then in double.
template <class V, class T>
void gram3(const T* a, std::int64_t lda, const T* b, std::int64_t ldb, std::int64_t rows, double* g) {
  constexpr std::int64_t kPart = 16 * kLanes<V>;
  for (int k = 0; k < 9; ++k) g[k] = 0.0;
  for (std::int64_t first = 0; first < rows; first += kPart) {
    const std::int64_t last = rows - first < kPart ? rows : first + kPart;
    V sum[3][3];
#pragma GCC unroll 9
    for (int k = 0; k < 9; ++k) sum[k / 3][k % 3] = V(T(0));
    for (std::int64_t i = first; i < last; i += kLanes<V>) {
      const V x[3] = {V::load_unaligned(a + i), V::load_unaligned(a + i + lda), V::load_unaligned(a + i + 2 * lda)};
#pragma GCC unroll 3
      for (int d = 0; d < 3; ++d) {
        const V y = V::load_unaligned(b + i + d * ldb);
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) sum[c][d] = xsimd::fma(x[c], y, sum[c][d]);
      }
    }
#pragma GCC unroll 9
    for (int k = 0; k < 9; ++k) g[k] += sum_of_lanes<V, T>(sum[k / 3][k % 3]);
  }
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

// out = the sum of 3 count rows of doubles, `ld` apart by three, each times its weight; length in whole vectors.
template <class V>
void combine3(const double* const* rows, std::int64_t ld, const double* w, int count, std::int64_t length,
              double* out) {
  using D = xsimd::batch<double, typename V::arch_type>;
  for (std::int64_t i = 0; i < length; i += kLanes<D>) {
    D sum(0.0);
    for (int k = 0; k < count; ++k)
#pragma GCC unroll 3
      for (int c = 0; c < 3; ++c) sum = xsimd::fma(D(w[3 * k + c]), D::load_unaligned(rows[k] + c * ld + i), sum);
    sum.store_unaligned(out + i);
  }
}

}  // namespace qlb::dense
