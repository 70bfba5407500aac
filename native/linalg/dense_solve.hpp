// Forward and backward substitution in the panel of a supernode; see dense_kernels.hpp for what each function does.
//
// Both stream the panel once, a block of columns at a time, and for each block walk down its rows. Sums have an order
// that neither the number of threads nor how rows and columns are shared among them changes.
#pragma once

#include "linalg/dense_kernels.hpp"
#include "linalg/tile.hpp"

namespace qlb::dense {

// The coefficients of a block of columns for all sides, those of one column together: a tile's B.
template <class V, int sides, class T>
inline void gather(const T* x, std::int64_t ldx, int n, T* to) {
  for (int p = 0; p < n; ++p)
    for (int r = 0; r < sides; ++r) to[p * sides + r] = x[p + r * ldx];
}

// x (rows x sides) -= or = panel (rows x n) times the coefficients.
template <class V, int sides, Store store, class T>
inline void times_panel(const T* panel, std::int64_t ld, int n, const T* coefficients, T* x, std::int64_t ldx,
                        std::int64_t rows) {
  constexpr int M = sides == 1 ? 4 : kManyRegisters<V> ? 3 : 1;
  constexpr int height = M * kLanes<V>;
  std::int64_t i = 0;
  for (; i + height <= rows; i += height)
    tile<V, M, sides, store>(n, panel + i, ld, coefficients, sides, x + i, ldx, height, sides);
  for (; i < rows; i += kLanes<V>) {
    const int rest = static_cast<int>(rows - i < kLanes<V> ? rows - i : kLanes<V>);
    tile<V, 1, sides, store>(n, panel + i, ld, coefficients, sides, x + i, ldx, rest, sides);
  }
}

template <class V, int sides, class T>
inline void forward_own_sides(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, T* x,
                              std::int64_t ldx) {
  alignas(64) T coefficients[kBlock * sides];
  for (std::int64_t j = begin; j < end; j += kBlock) {
    const int n = static_cast<int>(end - j < kBlock ? end - j : kBlock);
    gather<V, sides>(x + j, ldx, n, coefficients);
    times_panel<V, sides, Store::positive>(panel + j + j * ld, ld, n, coefficients, x + j, ldx, n);
    gather<V, sides>(x + j, ldx, n, coefficients);
    times_panel<V, sides, Store::subtract>(panel + j + n + j * ld, ld, n, coefficients, x + j + n, ldx, end - j - n);
  }
}

template <class V, int sides, class T>
inline void forward_below_sides(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end,
                                std::int64_t first, std::int64_t last, T* x, std::int64_t ldx) {
  alignas(64) T coefficients[kBlock * sides];
  for (std::int64_t j = begin; j < end; j += kBlock) {
    const int n = static_cast<int>(end - j < kBlock ? end - j : kBlock);
    gather<V, sides>(x + j, ldx, n, coefficients);
    times_panel<V, sides, Store::subtract>(panel + first + j * ld, ld, n, coefficients, x + first, ldx, last - first);
  }
}

template <class V, class T>
inline T sum_of_lanes(const V& v) {
#if defined(__AVX512F__)
  if constexpr (sizeof(V) == 64 && sizeof(T) == 8)
    return _mm512_reduce_add_pd(v);
  else if constexpr (sizeof(V) == 64)
    return _mm512_reduce_add_ps(v);
  else
#endif
    return xsimd::hadd(v);
}

// sums[c][r] = column c of the panel times side r of x, over rows in steps of a vector.
template <class V, int columns, int sides, class T>
inline void dots(const T* panel, std::int64_t ld, const T* x, std::int64_t ldx, std::int64_t rows,
                 T (&sums)[columns][sides]) {
  V sum[columns][sides];
#pragma GCC unroll 8
  for (int c = 0; c < columns; ++c)
#pragma GCC unroll 8
    for (int r = 0; r < sides; ++r) sum[c][r] = V(T(0));
  for (std::int64_t i = 0; i < rows; i += kLanes<V>) {
    V side[sides];
#pragma GCC unroll 8
    for (int r = 0; r < sides; ++r) side[r] = V::load_unaligned(x + i + r * ldx);
#pragma GCC unroll 8
    for (int c = 0; c < columns; ++c) {
      const V column = V::load_unaligned(panel + i + c * ld);
#pragma GCC unroll 8
      for (int r = 0; r < sides; ++r) sum[c][r] = xsimd::fma(column, side[r], sum[c][r]);
    }
  }
#pragma GCC unroll 8
  for (int c = 0; c < columns; ++c)
#pragma GCC unroll 8
    for (int r = 0; r < sides; ++r) sums[c][r] = sum_of_lanes<V, T>(sum[c][r]);
}

// x[j] -= or = column j of the panel times y, for each of n columns and each side.
template <class V, int sides, bool subtract, class T>
inline void times_columns(const T* panel, std::int64_t ld, int n, const T* y, std::int64_t ldy, std::int64_t rows, T* x,
                          std::int64_t ldx) {
  constexpr int group = sides == 1 ? 8 : kManyRegisters<V> ? 2 : 1;
  const auto put = [&](int c, int r, T sum) { x[c + r * ldx] = subtract ? x[c + r * ldx] - sum : sum; };
  int j = 0;
  for (; j + group <= n; j += group) {
    T sums[group][sides];
    dots<V>(panel + j * ld, ld, y, ldy, rows, sums);
    for (int c = 0; c < group; ++c)
      for (int r = 0; r < sides; ++r) put(j + c, r, sums[c][r]);
  }
  for (; j < n; ++j) {
    T sums[1][sides];
    dots<V>(panel + j * ld, ld, y, ldy, rows, sums);
    for (int r = 0; r < sides; ++r) put(j, r, sums[0][r]);
  }
}

template <class V, int sides, class T>
inline void backward_own_sides(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, T* x,
                               std::int64_t ldx) {
  alignas(64) T below[kWide * sides + kPadding], own[kBlock * sides + kPadding];
  for (std::int64_t k = 0; k < kWide * sides + kPadding; ++k) below[k] = T(0);
  for (std::int64_t j = begin + (end - begin - 1) / kBlock * kBlock; j >= begin; j -= kBlock) {
    const int n = static_cast<int>(end - j < kBlock ? end - j : kBlock);
    times_columns<V, sides, true>(panel + j + n + j * ld, ld, n, below + (j + n - begin), kWide, end - j - n, x + j,
                                  ldx);
    for (int r = 0; r < sides; ++r)
      for (int p = 0; p < kBlock; ++p) own[p + r * kBlock] = p < n ? x[j + p + r * ldx] : T(0);
    times_columns<V, sides, false>(panel + j + j * ld, ld, n, own, kBlock, kBlock, x + j, ldx);
    for (int r = 0; r < sides; ++r)
      for (int p = 0; p < n; ++p) below[j - begin + p + r * kWide] = x[j + p + r * ldx];
  }
}

template <class V, class T>
void forward_own(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, T* x, std::int64_t ldx,
                 int sides) {
  if (sides == 1)
    forward_own_sides<V, 1>(panel, ld, begin, end, x, ldx);
  else
    forward_own_sides<V, kRightSides>(panel, ld, begin, end, x, ldx);
}

template <class V, class T>
void forward_below(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, std::int64_t first,
                   std::int64_t last, T* x, std::int64_t ldx, int sides) {
  if (sides == 1)
    forward_below_sides<V, 1>(panel, ld, begin, end, first, last, x, ldx);
  else
    forward_below_sides<V, kRightSides>(panel, ld, begin, end, first, last, x, ldx);
}

template <class V, class T>
void backward_above(const T* panel, std::int64_t ld, std::int64_t front, std::int64_t begin, std::int64_t end,
                    std::int64_t first, T* x, std::int64_t ldx, int sides) {
  const auto n = static_cast<int>(end - begin);
  const T* from = panel + first + begin * ld;
  if (sides == 1)
    times_columns<V, 1, true>(from, ld, n, x + first, ldx, front - first, x + begin, ldx);
  else
    times_columns<V, kRightSides, true>(from, ld, n, x + first, ldx, front - first, x + begin, ldx);
}

template <class V, class T>
void backward_own(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, T* x, std::int64_t ldx,
                  int sides) {
  if (sides == 1)
    backward_own_sides<V, 1>(panel, ld, begin, end, x, ldx);
  else
    backward_own_sides<V, kRightSides>(panel, ld, begin, end, x, ldx);
}

}  // namespace qlb::dense
