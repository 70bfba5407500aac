// Products of a node's three columns (NodeColumns). Products of floats are summed in double.
#pragma once

#include "linalg/tile.hpp"

namespace qlb::dense {

// g (3 x 3, row by row) = A^T B, A and B (rows x 3).
template <class V, class T>
void gram3(const T* a, std::int64_t lda, const T* b, std::int64_t ldb, std::int64_t rows, double* g) {
  const T *a0 = a, *a1 = a + lda, *a2 = a + 2 * lda;
  for (int d = 0; d < 3; ++d, b += ldb) {
    double g0 = 0.0, g1 = 0.0, g2 = 0.0;
#pragma omp simd reduction(+ : g0, g1, g2)
    for (std::int64_t i = 0; i < rows; ++i) {
      const double w = b[i];
      g0 += static_cast<double>(a0[i]) * w;
      g1 += static_cast<double>(a1[i]) * w;
      g2 += static_cast<double>(a2[i]) * w;
    }
    g[d] = g0, g[3 + d] = g1, g[6 + d] = g2;
  }
}

// t (3) += A^T y.
template <class V, class T>
void dots3(const T* a, std::int64_t lda, const T* y, std::int64_t rows, double* t) {
  const T *a0 = a, *a1 = a + lda, *a2 = a + 2 * lda;
  double t0 = 0.0, t1 = 0.0, t2 = 0.0;
#pragma omp simd reduction(+ : t0, t1, t2)
  for (std::int64_t i = 0; i < rows; ++i) {
    const double w = y[i];
    t0 += static_cast<double>(a0[i]) * w;
    t1 += static_cast<double>(a1[i]) * w;
    t2 += static_cast<double>(a2[i]) * w;
  }
  t[0] += t0, t[1] += t1, t[2] += t2;
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
