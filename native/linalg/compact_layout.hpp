// Where things stand in the compact copy of a panel: entries of L in 16 bits, for solves that are bound by reading it.
//
// Each column has a scale, the largest entry below its diagonal block over 32767, and its entries are whole multiples
// of that: the error is at most half a scale, 1.5e-5 of the largest. Columns come in wide blocks of kWide. A wide block
// [begin, end) holds, for each of its blocks of kBlock columns, first what belongs to its own rows,
//
//   the inverse of the diagonal block, kBlock floats a column; kBlock scales; tiles of the rows down to `end`,
//
// then, for each block again, the tiles of the rows from `end` to the front's last. A tile is kTileHeight rows, column
// by column, with zeros below the last row: so a solve reads one stream from first to last, or the other way round.
#pragma once

#include <cstdint>

#include "linalg/dense_kernels.hpp"

namespace qlb {

constexpr int kTileHeight = kBlock;

// Inlined wherever it stands, since it is compiled for several SIMD levels.
#define QLB_INLINE [[gnu::always_inline]] inline

struct CompactLayout {
  std::int64_t front, begin, end;  // rows of the front, and columns of the wide block

  QLB_INLINE static std::int64_t tiles(std::int64_t rows) { return (rows + kTileHeight - 1) / kTileHeight; }
  QLB_INLINE static std::int64_t tile_bytes(std::int64_t width) { return 2 * kTileHeight * width; }
  QLB_INLINE static std::int64_t head_bytes(std::int64_t width) { return 4 * kBlock * (width + 1); }

  // Of the block of columns that starts at j.
  QLB_INLINE std::int64_t width(std::int64_t j) const { return end - j < kBlock ? end - j : kBlock; }
  QLB_INLINE std::int64_t own_tiles(std::int64_t j) const { return tiles(end - j - width(j)); }
  QLB_INLINE std::int64_t tiles_below() const { return tiles(front - end); }
  QLB_INLINE std::int64_t own(std::int64_t j) const { return own_bytes(j); }
  QLB_INLINE std::int64_t below(std::int64_t j) const { return own_bytes(end) + tiles_below() * tile_bytes(j - begin); }
  QLB_INLINE std::int64_t bytes() const { return below(end); }

 private:
  // Of the blocks of columns before j.
  QLB_INLINE std::int64_t own_bytes(std::int64_t j) const {
    std::int64_t sum = 0;
    for (std::int64_t k = begin; k < j; k += kBlock) sum += head_bytes(width(k)) + own_tiles(k) * tile_bytes(width(k));
    return sum;
  }
};

#undef QLB_INLINE

}  // namespace qlb
