// Long vectors: inner products, and sums of multiples.
#pragma once

#include "linalg/dense_solve.hpp"

namespace qlb::dense {

// Four sums at once, since each addition waits for the one before.
template <class V, class T>
T dot(const T* a, const T* b, std::int64_t n) {
  constexpr int ways = 4, lanes = kLanes<V>;
  V sum[ways];
  for (V& part : sum) part = V(T(0));
  std::int64_t k = 0;
  for (; k + ways * lanes <= n; k += ways * lanes)
#pragma GCC unroll 4
    for (int w = 0; w < ways; ++w)
      sum[w] = xsimd::fma(V::load_unaligned(a + k + w * lanes), V::load_unaligned(b + k + w * lanes), sum[w]);
  for (; k + lanes <= n; k += lanes) sum[0] = xsimd::fma(V::load_unaligned(a + k), V::load_unaligned(b + k), sum[0]);
  T rest(0);
  for (; k < n; ++k) rest += a[k] * b[k];
  return sum_of_lanes<V, T>((sum[0] + sum[1]) + (sum[2] + sum[3])) + rest;
}

// b += scale a
template <class V, class T>
void add_scaled(T scale, const T* a, T* b, std::int64_t n) {
  const V factor(scale);
  std::int64_t k = 0;
  for (; k + kLanes<V> <= n; k += kLanes<V>)
    xsimd::fma(factor, V::load_unaligned(a + k), V::load_unaligned(b + k)).store_unaligned(b + k);
  if (const int rest = static_cast<int>(n - k); rest > 0)
    store_part<V>(xsimd::fma(factor, load_part<V>(a + k, rest), load_part<V>(b + k, rest)), b + k, rest);
}

}  // namespace qlb::dense
