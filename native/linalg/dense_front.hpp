// Dense partial Cholesky factorisation of a front; see dense_kernels.hpp for what each function does.
#pragma once

#include "linalg/dense_kernels.hpp"
#include "linalg/tile.hpp"

namespace qlb::dense {

// Row k of U and of X, from [S | I] -> [U | X] by elimination, U = L^T and X = L^-1: one pass gives both. The upper
// rows of S are the lower columns of the block.
template <class V, class T>
inline int eliminate(T (&s)[kBlock][kBlock], T (&x)[kBlock][kBlock], int n) {
  constexpr int vectors = kBlock / kLanes<V>;
  constexpr T largest = sizeof(T) == 8 ? T(1.7976931348623157e308) : T(3.4028234663852886e38);
  for (int k = 0; k < n; ++k) {
    const T pivot = s[k][k];
    if (!(pivot > T(0) && pivot <= largest)) return k;
    const V inverse(T(1) / __builtin_sqrt(pivot));
    V u[vectors], y[vectors];
    for (int v = 0; v < vectors; ++v) {
      u[v] = V::load_aligned(s[k] + v * kLanes<V>) * inverse;
      y[v] = V::load_aligned(x[k] + v * kLanes<V>) * inverse;
      u[v].store_aligned(s[k] + v * kLanes<V>);
      y[v].store_aligned(x[k] + v * kLanes<V>);
    }
    for (int i = k + 1; i < n; ++i) {
      const V factor(s[k][i]);
      for (int v = 0; v < vectors; ++v) {
        T *si = s[i] + v * kLanes<V>, *xi = x[i] + v * kLanes<V>;
        xsimd::fnma(factor, u[v], V::load_aligned(si)).store_aligned(si);
        xsimd::fnma(factor, y[v], V::load_aligned(xi)).store_aligned(xi);
      }
    }
  }
  return -1;
}

// Replaces the lower triangle of an n x n block, n <= kBlock, by the inverse of its Cholesky factor.
template <class V, class T>
inline int invert_factor(T* block, std::int64_t ld, int n) {
  alignas(64) T s[kBlock][kBlock] = {}, x[kBlock][kBlock] = {};
  for (int k = 0; k < n; ++k) {
    for (int i = k; i < n; ++i) s[k][i] = block[i + k * ld];
    x[k][k] = T(1);
  }
  const int bad = eliminate<V>(s, x, n);
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i) block[i + k * ld] = x[i][k];
  return bad;
}

// rows (count x n) := rows X^T, n <= kBlock, X lower triangular: later columns first, so that it can be done in place.
template <class V, class T>
inline void times_transpose(const T* x, std::int64_t ldx, int n, T* rows, std::int64_t ld, std::int64_t count) {
  constexpr int N = kTileColumns<V>;
  for (std::int64_t i = 0; i < count; i += kTileRows<V>) {
    const int tile_rows = static_cast<int>(count - i < kTileRows<V> ? count - i : kTileRows<V>);
    for (int j = (n - 1) / N * N; j >= 0; j -= N) {
      const int columns = n - j < N ? n - j : N;
      any_tile<V, Store::positive>(j + columns, rows + i, ld, x + j, ldx, rows + i + j * ld, ld, tile_rows, columns);
    }
  }
}

// C -= A B^T or C = -A B^T, unpacked.
template <class V, Store store, class T>
inline void product(T* c, std::int64_t ldc, const T* a, std::int64_t lda, const T* b, std::int64_t ldb,
                    std::int64_t rows, std::int64_t columns, std::int64_t depth, bool lower) {
  constexpr int N = kTileColumns<V>;
  for (std::int64_t j = 0; j < columns; j += N) {
    const int width = static_cast<int>(columns - j < N ? columns - j : N);
    for (std::int64_t i = lower ? j / kLanes<V> * kLanes<V> : 0; i < rows; i += kTileRows<V>) {
      const int height = static_cast<int>(rows - i < kTileRows<V> ? rows - i : kTileRows<V>);
      any_tile<V, store>(depth, a + i, lda, b + j, ldb, c + i + j * ldc, ldc, height, width);
    }
  }
}

// Left-looking by blocks of kBlock columns.
template <class V, class T>
int factor(T* panel, std::int64_t ld, std::int64_t front, std::int64_t columns) {
  for (std::int64_t j = 0; j < columns; j += kBlock) {
    const int n = static_cast<int>(columns - j < kBlock ? columns - j : kBlock);
    T* block = panel + j + j * ld;
    if (j > 0) product<V, Store::subtract>(block, ld, panel + j, ld, panel + j, ld, front - j, n, j, true);
    if (const int bad = invert_factor<V>(block, ld, n); bad >= 0) return static_cast<int>(j) + bad;
    times_transpose<V>(block, ld, n, block + n, ld, front - j - n);
  }
  return -1;
}

// last: the rows of the last block of columns, kBlock apart.
template <class V, class T>
inline void solve_strip(const T* triangle, std::int64_t ldt, const T* last, std::int64_t columns, T* rows,
                        std::int64_t ld, std::int64_t count) {
  for (std::int64_t j = 0; j < columns; j += kBlock) {
    const bool at_end = columns - j <= kBlock;
    const int n = static_cast<int>(at_end ? columns - j : kBlock);
    const T* block = at_end ? last : triangle + j;
    const std::int64_t ldb = at_end ? kBlock : ldt;
    if (j > 0) product<V, Store::subtract>(rows + j * ld, ld, rows, ld, block, ldb, count, n, j, false);
    times_transpose<V>(block + j * ldb, ldb, n, rows + j * ld, ld, count);
  }
}

// A strip of rows at a time, copied to where its columns lie close together. The last rows of the triangle are copied
// too: a tile reads past them, and there other threads may be at work.
template <class V, class T>
void solve_rows(const T* triangle, std::int64_t ldt, std::int64_t columns, T* rows, std::int64_t ld, std::int64_t count,
                T* work) {
  constexpr std::int64_t strip = kTileRows<V>;
  T* last = work + strip * columns;
  const std::int64_t first = (columns - 1) / kBlock * kBlock;
  for (std::int64_t j = 0; j < columns; ++j)
    for (std::int64_t k = 0; k < kBlock; ++k)
      last[k + j * kBlock] = first + k < columns ? triangle[first + k + j * ldt] : T(0);
  for (std::int64_t i = 0; i < count; i += strip) {
    const std::int64_t height = count - i < strip ? count - i : strip;
    for (std::int64_t j = 0; j < columns; ++j)
      for (std::int64_t k = 0; k < height; ++k) work[k + j * strip] = rows[i + k + j * ld];
    solve_strip<V>(triangle, ldt, last, columns, work, strip, height);
    for (std::int64_t j = 0; j < columns; ++j)
      for (std::int64_t k = 0; k < height; ++k) rows[i + k + j * ld] = work[k + j * strip];
  }
}

// Strips of `height` rows, each with its columns one after the other.
template <class V, int height, class T>
inline void pack(const T* a, std::int64_t ld, std::int64_t rows, std::int64_t depth, T* to) {
  for (std::int64_t i = 0; i < rows; i += height)
    for (std::int64_t p = 0; p < depth; ++p, to += height) {
      const T* from = a + i + p * ld;
      if (rows - i >= height)
        for (int k = 0; k < height; ++k) to[k] = from[k];
      else
        for (int k = 0; k < height; ++k) to[k] = k < rows - i ? from[k] : T(0);
    }
}

// The same product for large operands: slices of depth kDepth are packed (Goto, van de Geijn 2008).
template <class V, class T>
void packed_product(T* c, std::int64_t ldc, const T* a, const T* b, std::int64_t ld, std::int64_t rows,
                    std::int64_t columns, std::int64_t depth, bool lower, bool fresh, T* work) {
  constexpr int M = kTileRows<V>, N = kTileColumns<V>;
  for (std::int64_t start = 0; start < depth; start += kDepth) {
    const std::int64_t slice = depth - start < kDepth ? depth - start : kDepth;
    T *strips = work, *other = work + (rows + M) * slice;
    pack<V, M>(a + start * ld, ld, rows, slice, strips);
    pack<V, N>(b + start * ld, ld, columns, slice, other);
    for (std::int64_t j = 0; j < columns; j += N) {
      const int width = static_cast<int>(columns - j < N ? columns - j : N);
      for (std::int64_t i = lower ? j / M * M : 0; i < rows; i += M) {
        const int height = static_cast<int>(rows - i < M ? rows - i : M);
        T* target = c + i + j * ldc;
        if (fresh && start == 0)
          any_tile<V, Store::negative>(slice, strips + i * slice, M, other + j * slice, N, target, ldc, height, width);
        else
          any_tile<V, Store::subtract>(slice, strips + i * slice, M, other + j * slice, N, target, ldc, height, width);
      }
    }
  }
}

template <class V, class T>
void subtract(T* c, std::int64_t ldc, const T* a, const T* b, std::int64_t ld, std::int64_t rows, std::int64_t columns,
              std::int64_t depth, bool lower, bool fresh, T* work) {
  if (depth >= 32 && rows >= 96)
    packed_product<V>(c, ldc, a, b, ld, rows, columns, depth, lower, fresh, work);
  else if (fresh)
    product<V, Store::negative>(c, ldc, a, ld, b, ld, rows, columns, depth, lower);
  else
    product<V, Store::subtract>(c, ldc, a, ld, b, ld, rows, columns, depth, lower);
}

template <class V, class T>
inline void add_to(T* to, const T* from, std::int64_t count) {
  std::int64_t i = 0;
  for (; i + kLanes<V> <= count; i += kLanes<V>)
    (V::load_unaligned(to + i) + V::load_unaligned(from + i)).store_unaligned(to + i);
  if (const int rest = static_cast<int>(count - i); rest > 0) {
#if defined(__AVX512F__)
    if constexpr (sizeof(V) == 64)
      return store_part<V>(load_part<V>(to + i, rest) + load_part<V>(from + i, rest), to + i, rest);
#endif
    for (; i < count; ++i) to[i] += from[i];
  }
}

struct Run {
  std::int32_t start, position, length;
};

template <class V, class T>
void extend_add(T* front, std::int64_t ld, const T* update, std::int64_t ldu, const std::int32_t* runs,
                std::int64_t run_count, std::int64_t begin, std::int64_t end) {
  const auto run_at = [runs](std::int64_t k) { return Run{runs[3 * k], runs[3 * k + 1], runs[3 * k + 2]}; };
  for (std::int64_t a = 0; a < run_count; ++a) {
    const Run across = run_at(a);
    const std::int64_t first = across.start < begin ? begin : across.start;
    const std::int64_t last = across.start + across.length < end ? across.start + across.length : end;
    if (first >= last) continue;
    T* columns = front + (across.position - across.start) * ld;
    for (std::int64_t j = first; j < last; ++j)
      add_to<V>(columns + j * ld + across.position + (j - across.start), update + j * ldu + j,
                across.start + across.length - j);
    for (std::int64_t k = a + 1; k < run_count; ++k) {
      const Run down = run_at(k);
      for (std::int64_t j = first; j < last; ++j)
        add_to<V>(columns + j * ld + down.position, update + j * ldu + down.start, down.length);
    }
  }
}

}  // namespace qlb::dense
