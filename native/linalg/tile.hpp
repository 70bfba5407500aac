// The register tile of the dense kernels, C = c C +- A B^T, for column-major A (rows x depth) and B (columns x depth).
//
// Templates over the vector type V, as in simd/arch.hpp. The product of each entry is summed over the depth in order,
// by fused multiply-adds, whatever tile holds the entry: so the bits do not depend on how a matrix is cut into tiles.
//
// A and B are read in whole vectors and tiles: up to a vector of rows, or a tile of columns, past their ends. No other
// thread may write there.
#pragma once

#include <cstdint>
#include <xsimd/xsimd.hpp>

namespace qlb {

enum class Store { subtract, negative, positive };  // C -= A B^T, C = -A B^T, C = A B^T

template <class V>
constexpr int kLanes = static_cast<int>(V::size);
// Three vectors of rows by this many columns fill the registers: 32, or 16 up to AVX2.
template <class V>
constexpr bool kManyRegisters = sizeof(V) == 64;
template <class V>
constexpr int kTileRows = 3 * kLanes<V>;
template <class V>
constexpr int kTileColumns = kManyRegisters<V> ? 8 : 4;

// The first `count` (1 to lanes - 1) entries; the rest is zero.
template <class V, class T>
inline V load_part(const T* from, int count) {
#if defined(__AVX512F__)
  if constexpr (sizeof(V) == 64 && sizeof(T) == 8)
    return V(_mm512_maskz_loadu_pd(static_cast<__mmask8>((1u << count) - 1u), from));
  else if constexpr (sizeof(V) == 64)
    return V(_mm512_maskz_loadu_ps(static_cast<__mmask16>((1u << count) - 1u), from));
#endif
  alignas(64) T buffer[kLanes<V>] = {};
  for (int i = 0; i < count; ++i) buffer[i] = from[i];
  return V::load_aligned(buffer);
}

template <class V, class T>
inline void store_part(const V& value, T* to, int count) {
#if defined(__AVX512F__)
  if constexpr (sizeof(V) == 64 && sizeof(T) == 8)
    return _mm512_mask_storeu_pd(to, static_cast<__mmask8>((1u << count) - 1u), value);
  else if constexpr (sizeof(V) == 64)
    return _mm512_mask_storeu_ps(to, static_cast<__mmask16>((1u << count) - 1u), value);
#endif
  alignas(64) T buffer[kLanes<V>];
  value.store_aligned(buffer);
  for (int i = 0; i < count; ++i) to[i] = buffer[i];
}

template <class V, Store store, class T>
inline void store_tile_vector(const V& sum, T* c, int rows) {
  if (rows >= kLanes<V>) {
    if constexpr (store == Store::subtract)
      (V::load_unaligned(c) - sum).store_unaligned(c);
    else
      (store == Store::negative ? -sum : sum).store_unaligned(c);
  } else if (rows > 0) {
    if constexpr (store == Store::subtract)
      store_part<V>(load_part<V>(c, rows) - sum, c, rows);
    else
      store_part<V>(store == Store::negative ? -sum : sum, c, rows);
  }
}

// M vectors by N columns, of which `rows` and `columns` are stored.
template <class V, int M, int N, Store store, class T>
inline void tile(std::int64_t depth, const T* a, std::int64_t lda, const T* b, std::int64_t ldb, T* c, std::int64_t ldc,
                 int rows, int columns) {
  V sum[N][M];
#pragma GCC unroll 8
  for (int j = 0; j < N; ++j)
#pragma GCC unroll 8
    for (int i = 0; i < M; ++i) sum[j][i] = V(T(0));
  for (std::int64_t p = 0; p < depth; ++p, a += lda, b += ldb) {
    V column[M];
#pragma GCC unroll 8
    for (int i = 0; i < M; ++i) column[i] = V::load_unaligned(a + i * kLanes<V>);
#pragma GCC unroll 8
    for (int j = 0; j < N; ++j) {
      const V factor(b[j]);
#pragma GCC unroll 8
      for (int i = 0; i < M; ++i) sum[j][i] = xsimd::fma(column[i], factor, sum[j][i]);
    }
  }
#pragma GCC unroll 8
  for (int j = 0; j < N; ++j) {
    if (j >= columns) return;
#pragma GCC unroll 8
    for (int i = 0; i < M; ++i)
      store_tile_vector<V, store>(sum[j][i], c + j * ldc + i * kLanes<V>, rows - i * kLanes<V>);
  }
}

// A tile of up to three vectors of rows by N columns.
template <class V, int N, Store store, class T>
inline void tile_rows(std::int64_t depth, const T* a, std::int64_t lda, const T* b, std::int64_t ldb, T* c,
                      std::int64_t ldc, int rows, int columns) {
  if (rows > 2 * kLanes<V>)
    tile<V, 3, N, store>(depth, a, lda, b, ldb, c, ldc, rows, columns);
  else if (rows > kLanes<V>)
    tile<V, 2, N, store>(depth, a, lda, b, ldb, c, ldc, rows, columns);
  else
    tile<V, 1, N, store>(depth, a, lda, b, ldb, c, ldc, rows, columns);
}

template <class V, Store store, class T>
inline void any_tile(std::int64_t depth, const T* a, std::int64_t lda, const T* b, std::int64_t ldb, T* c,
                     std::int64_t ldc, int rows, int columns) {
  constexpr int N = kTileColumns<V>;
  if (columns > N / 2)
    tile_rows<V, N, store>(depth, a, lda, b, ldb, c, ldc, rows, columns);
  else
    tile_rows<V, N / 2, store>(depth, a, lda, b, ldb, c, ldc, rows, columns);
}

}  // namespace qlb
