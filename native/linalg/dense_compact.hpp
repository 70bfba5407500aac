// Substitution in the compact copy of a panel (compact_layout.hpp), and how the copy is made.
#pragma once

#include <cstring>
#include <type_traits>

#include "linalg/compact_layout.hpp"
#include "linalg/dense_solve.hpp"

namespace qlb::dense {

// As many 16-bit numbers as V has lanes, as floats.
template <class V>
inline V load_small(const std::int16_t* from) {
#if defined(__AVX512F__)
  return V(_mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_load_si256(reinterpret_cast<const __m256i*>(from)))));
#elif defined(__AVX2__)
  return V(_mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_load_si128(reinterpret_cast<const __m128i*>(from)))));
#elif defined(__SSE2__)
  const __m128i four = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from));
  return V(_mm_cvtepi32_ps(_mm_srai_epi32(_mm_unpacklo_epi16(four, four), 16)));
#else
  alignas(64) float buffer[kLanes<V>];
  for (int k = 0; k < kLanes<V>; ++k) buffer[k] = from[k];
  return V::load_aligned(buffer);
#endif
}

// Of a stream this far ahead, past the page that the processor itself would stop at.
constexpr std::int64_t kAhead = 8192;

template <class V, int bytes>
inline void prefetch(const void* from) {
#pragma GCC unroll 8
  for (int k = 0; k < bytes; k += 64) __builtin_prefetch(static_cast<const std::byte*>(from) + kAhead + k);
}

// x (kTileHeight) -= tile times the coefficients of its columns; two chains of sums, since each addition waits for the
// one before.
template <class V, int columns>
inline void subtract_tile(const std::int16_t* from, const float* coefficients, float* x) {
  constexpr int M = kTileHeight / kLanes<V>;
  V sum[2][M];
#pragma GCC unroll 4
  for (int i = 0; i < M; ++i) sum[0][i] = V::load_unaligned(x + i * kLanes<V>), sum[1][i] = V(0.0f);
#pragma GCC unroll 16
  for (int p = 0; p < columns; ++p) {
    const V factor(coefficients[p]);
#pragma GCC unroll 4
    for (int i = 0; i < M; ++i)
      sum[p % 2][i] = xsimd::fnma(load_small<V>(from + p * kTileHeight + i * kLanes<V>), factor, sum[p % 2][i]);
  }
#pragma GCC unroll 4
  for (int i = 0; i < M; ++i) (sum[0][i] + sum[1][i]).store_unaligned(x + i * kLanes<V>);
}

// Calls f<N> for N = n, from 1 to `most`.
template <int most, class F>
inline void with_width(int n, const F& f) {
  if (n == most)
    f.template operator()<most>();
  else if constexpr (most > 1)
    with_width<most - 1>(n, f);
}

// x (tiles x kTileHeight) -= tiles times the coefficients of n columns.
template <class V>
inline void subtract_tiles(const std::int16_t* from, std::int64_t tiles, int n, const float* coefficients, float* x) {
  with_width<kBlock>(n, [&]<int width>() {
    for (std::int64_t t = 0; t < tiles; ++t, from += width * kTileHeight, x += kTileHeight) {
      prefetch<V, 2 * width * kTileHeight>(from);
      subtract_tile<V, width>(from, coefficients, x);
    }
  });
}

#if defined(__AVX512F__)
// The sum of the lanes of each of 16 vectors, by adding up halves of two at a time.
inline __m512 sums_of_lanes(const __m512 (&v)[16]) {
  __m512 quarter[4];  // of v[q], v[q + 4], v[q + 8], v[q + 12], four lanes each
#pragma GCC unroll 4
  for (int q = 0; q < 4; ++q) {
    const auto halves = [](__m512 a, __m512 b) {
      return _mm512_add_ps(_mm512_shuffle_f32x4(a, b, 0x44), _mm512_shuffle_f32x4(a, b, 0xee));
    };
    const __m512 first = halves(v[q], v[q + 4]), second = halves(v[q + 8], v[q + 12]);
    quarter[q] = _mm512_add_ps(_mm512_shuffle_f32x4(first, second, 0x88), _mm512_shuffle_f32x4(first, second, 0xdd));
  }
  const auto pairs = [](__m512 a, __m512 b) {
    return _mm512_add_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
  };
  const __m512 low = pairs(quarter[0], quarter[1]), high = pairs(quarter[2], quarter[3]);
  return _mm512_add_ps(_mm512_shuffle_ps(low, high, 0x44), _mm512_shuffle_ps(low, high, 0xee));
}
#endif

// sums[c] = all lanes of sum[c].
template <class V, int columns>
inline void add_lanes(const V (&sum)[columns], float* sums) {
#if defined(__AVX512F__)
  __m512 all[16];
#pragma GCC unroll 16
  for (int c = 0; c < 16; ++c) all[c] = c < columns ? __m512(sum[c < columns ? c : 0]) : _mm512_setzero_ps();
  store_part<V>(V(sums_of_lanes(all)), sums, columns);
#else
  for (int c = 0; c < columns; ++c) sums[c] = sum_of_lanes<V, float>(sum[c]);
#endif
}

// sums[c] = column c of the tiles, n columns apart, times x.
template <class V, int columns>
inline void dot_tiles(const std::int16_t* from, std::int64_t tiles, int n, const float* x, float* sums) {
  constexpr int M = kTileHeight / kLanes<V>;
  V sum[columns];
#pragma GCC unroll 16
  for (int c = 0; c < columns; ++c) sum[c] = V(0.0f);
  for (std::int64_t t = 0; t < tiles; ++t, from += n * kTileHeight, x += kTileHeight) {
    prefetch<V, 2 * columns * kTileHeight>(from);
#pragma GCC unroll 4
    for (int i = 0; i < M; ++i) {
      const V side = V::load_unaligned(x + i * kLanes<V>);
#pragma GCC unroll 16
      for (int c = 0; c < columns; ++c)
        sum[c] = xsimd::fma(load_small<V>(from + c * kTileHeight + i * kLanes<V>), side, sum[c]);
    }
  }
  add_lanes<V, columns>(sum, sums);
}

// x[p] -= scale[p] times column p of the tiles times y, for n columns.
template <class V>
inline void subtract_dots(const std::int16_t* from, std::int64_t tiles, int n, const float* scale, const float* y,
                          float* x) {
  constexpr int group = kManyRegisters<V> ? 16 : 8;
  if (tiles == 0) return;
  float sums[kBlock];
  for (int p = 0; p < n; p += group)
    with_width<group>(n - p < group ? n - p : group,
                      [&]<int width>() { dot_tiles<V, width>(from + p * kTileHeight, tiles, n, y, sums + p); });
  for (int p = 0; p < n; ++p) x[p] -= scale[p] * sums[p];
}

// The parts of a block of columns, to be read, or written where Byte is not const.
template <class V, class Byte = const std::byte>
struct CompactBlock {
  template <class T>
  using Part = std::conditional_t<std::is_const_v<Byte>, const T*, T*>;

  CompactBlock(const CompactLayout& layout, Byte* block, std::int64_t j)
      : width(static_cast<int>(layout.width(j))),
        inverse(reinterpret_cast<Part<float>>(block + layout.own(j))),
        scale(inverse + kBlock * width),
        own(reinterpret_cast<Part<std::int16_t>>(scale + kBlock)),
        below(reinterpret_cast<Part<std::int16_t>>(block + layout.below(j))) {}
  int width;
  Part<float> inverse, scale;
  Part<std::int16_t> own, below;
};

template <class V>
inline void scale_coefficients(const CompactBlock<V>& at, const float* x, float* coefficients) {
  for (int p = 0; p < at.width; ++p) coefficients[p] = at.scale[p] * x[p];
}

template <class V>
void compact_forward_own(const CompactLayout& layout, const std::byte* block, float* x) {
  alignas(64) float coefficients[kBlock];
  for (std::int64_t j = layout.begin; j < layout.end; j += kBlock) {
    const CompactBlock<V> at(layout, block, j);
    for (int p = 0; p < at.width; ++p) coefficients[p] = x[j + p];
    times_panel<V, 1, Store::positive>(at.inverse, kBlock, at.width, coefficients, x + j, 0, at.width);
    scale_coefficients(at, x + j, coefficients);
    subtract_tiles<V>(at.own, layout.own_tiles(j), at.width, coefficients, x + j + at.width);
  }
}

template <class V>
void compact_forward_below(const CompactLayout& layout, const std::byte* block, std::int64_t first, std::int64_t last,
                           float* x) {
  alignas(64) float coefficients[kBlock];
  for (std::int64_t j = layout.begin; j < layout.end; j += kBlock) {
    const CompactBlock<V> at(layout, block, j);
    scale_coefficients(at, x + j, coefficients);
    subtract_tiles<V>(at.below + (first - layout.end) * at.width, CompactLayout::tiles(last - first), at.width,
                      coefficients, x + first);
  }
}

template <class V>
void compact_backward_above(const CompactLayout& layout, const std::byte* block, std::int64_t j, float* x) {
  const CompactBlock<V> at(layout, block, j);
  subtract_dots<V>(at.below, layout.tiles_below(), at.width, at.scale, x + layout.end, x + j);
}

template <class V>
void compact_backward_own(const CompactLayout& layout, const std::byte* block, float* x) {
  alignas(64) float own[kBlock + kPadding];
  for (std::int64_t j = layout.begin + (layout.end - layout.begin - 1) / kBlock * kBlock; j >= layout.begin;
       j -= kBlock) {
    const CompactBlock<V> at(layout, block, j);
    subtract_dots<V>(at.own, layout.own_tiles(j), at.width, at.scale, x + j + at.width, x + j);
    for (int p = 0; p < kBlock; ++p) own[p] = p < at.width ? x[j + p] : 0.0f;
    times_columns<V, 1, false>(at.inverse, kBlock, at.width, own, kBlock, kBlock, x + j, 0);
  }
}

// The largest of |v|; zero for none.
template <class V>
inline float largest(const float* v, std::int64_t n) {
  V most(0.0f);
  std::int64_t k = 0;
  for (; k + kLanes<V> <= n; k += kLanes<V>) most = xsimd::max(most, xsimd::abs(V::load_unaligned(v + k)));
  if (k < n) most = xsimd::max(most, xsimd::abs(load_part<V>(v + k, static_cast<int>(n - k))));
  alignas(64) float lanes[kLanes<V>];
  most.store_aligned(lanes);
  float all = 0.0f;
  for (const float lane : lanes) all = lane > all ? lane : all;
  return all;
}

// Up to kTileHeight entries in steps of 1/steps, rounded to the nearest: the sum with 1.5 2^23 ends in them as
// integers.
template <class V>
inline void pack_entries(const float* from, float steps, std::int16_t* to) {
  constexpr float magic = 12582912.0f;
#pragma GCC unroll 4
  for (int i = 0; i < kTileHeight; i += kLanes<V>) {
    alignas(64) std::uint32_t bits[kLanes<V>];
    const V rounded = xsimd::fma(V::load_unaligned(from + i), V(steps), V(magic));
    std::memcpy(bits, &rounded, sizeof(bits));
    for (int k = 0; k < kLanes<V>; ++k) to[i + k] = static_cast<std::int16_t>(bits[k]);
  }
}

// Rows of n columns, `ld` apart, in steps of their scales, into tiles.
template <class V>
inline void pack_tiles(const float* from, std::int64_t ld, std::int64_t rows, const float* steps, int n,
                       std::int16_t* to) {
  std::int64_t i = 0;
  for (; i + kTileHeight <= rows; i += kTileHeight)
    for (int p = 0; p < n; ++p, to += kTileHeight) pack_entries<V>(from + i + p * ld, steps[p], to);
  if (i == rows) return;
  for (int p = 0; p < n; ++p, to += kTileHeight) {
    alignas(64) float last[kTileHeight] = {};
    for (int k = 0; k < rows - i; ++k) last[k] = from[i + k + p * ld];
    pack_entries<V>(last, steps[p], to);
  }
}

template <class V>
void compact_pack(const CompactLayout& layout, const float* panel, std::byte* block) {
  constexpr float most_steps = 32767.0f, vanishing = 1e-30f;
  const std::int64_t ld = layout.front;
  for (std::int64_t j = layout.begin; j < layout.end; j += kBlock) {
    const CompactBlock<V, std::byte> at(layout, block, j);
    float steps[kBlock];
    const float *columns = panel + j * ld, *below = columns + j + at.width;
    for (int p = 0; p < at.width; ++p) {
      for (int k = 0; k < kBlock; ++k) at.inverse[p * kBlock + k] = k < at.width ? columns[j + k + p * ld] : 0.0f;
      const float most = largest<V>(below + p * ld, ld - j - at.width);
      at.scale[p] = most > vanishing ? most / most_steps : 0.0f;
      steps[p] = most > vanishing ? most_steps / most : 0.0f;
    }
    pack_tiles<V>(below, ld, layout.end - j - at.width, steps, at.width, at.own);
    pack_tiles<V>(columns + layout.end, ld, ld - layout.end, steps, at.width, at.below);
  }
}

}  // namespace qlb::dense
