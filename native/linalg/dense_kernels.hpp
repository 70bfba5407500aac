// Dense kernels of the supernodal factor, compiled once for each SIMD level, for T = float and double.
//
// All matrices are column-major. A panel (front x columns) keeps, in place of each diagonal block of kBlock columns of
// L, the block's inverse, with zeros above its diagonal: substitution then is nothing but products.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace qlb {

constexpr int kBlock = 16;      // columns eliminated at once
constexpr int kWide = 128;      // columns of a wide panel that are finished together
constexpr int kTask = 384;      // rows and columns of the pieces that threads share
constexpr int kDepth = 256;     // depth of a product that is packed at once
constexpr int kPadding = 16;    // entries that kernels may read past a matrix; its values do not matter but are finite
constexpr int kRightSides = 8;  // right-hand sides solved together
constexpr int kTermBlock = 16;  // terms multiplied together

// Entries of the work space that `subtract` and `solve_rows` need.
constexpr std::int64_t kWorkEntries = 2 * (kTask + 48) * kDepth + 64 * kWide;

struct CompactLayout;

// Substitution in the compact copy of a panel, one right-hand side: as `forward_own` and the like below, for the wide
// block that `layout` describes, rows [first, last), or the block of columns that starts at j. kPadding entries past
// the front of x are read, and must be finite.
struct CompactKernels {
  void (*pack)(const CompactLayout& layout, const float* panel, std::byte* block);
  void (*forward_own)(const CompactLayout& layout, const std::byte* block, float* x);
  void (*forward_below)(const CompactLayout& layout, const std::byte* block, std::int64_t first, std::int64_t last,
                        float* x);
  void (*backward_above)(const CompactLayout& layout, const std::byte* block, std::int64_t j, float* x);
  void (*backward_own)(const CompactLayout& layout, const std::byte* block, float* x);
};

// A vector u with three entries for each of up to four nodes, whose columns these are: 3 column[k] + (0, 1, 2).
struct NodeTerm {
  int count = 0;
  std::int32_t column[4];
  double u[4][3];
};

template <class T>
struct DenseKernels {
  const char* level;

  // Panel of `front` rows: its first `columns` columns become those of L. Returns the first column whose pivot is not
  // positive or not finite, or -1.
  int (*factor)(T* panel, std::int64_t ld, std::int64_t front, std::int64_t columns);
  // rows (count x columns) := rows L^-T, for L as `factor` left it; work: kWorkEntries.
  void (*solve_rows)(const T* triangle, std::int64_t ldt, std::int64_t columns, T* rows, std::int64_t ld,
                     std::int64_t count, T* work);
  // C (rows x columns) -= A B^T, or C = -A B^T if `fresh`. `lower`: only entries on and below the diagonal of C matter.
  void (*subtract)(T* c, std::int64_t ldc, const T* a, const T* b, std::int64_t ld, std::int64_t rows,
                   std::int64_t columns, std::int64_t depth, bool lower, bool fresh, T* work);
  // Adds columns [begin, end) of the child's update matrix (lower triangle) into the parent's front, whose row 0 and
  // column 0 would stand at `front`. runs: (start, position, length), as in Supernodes.
  void (*extend_add)(T* front, std::int64_t ld, const T* update, std::int64_t ldu, const std::int32_t* runs,
                     std::int64_t run_count, std::int64_t begin, std::int64_t end);

  // Substitution in a panel on `sides` (1 or kRightSides) right-hand sides, columns of x (front x sides), for columns
  // [begin, end) of the panel: their own part of x, or what they change in rows [first, last) of it (forward), or what
  // rows [first, front) change in them (backward). Backward needs kPadding zeros below each column of x.
  void (*forward_own)(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, T* x, std::int64_t ldx,
                      int sides);
  void (*forward_below)(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, std::int64_t first,
                        std::int64_t last, T* x, std::int64_t ldx, int sides);
  void (*backward_above)(const T* panel, std::int64_t ld, std::int64_t front, std::int64_t begin, std::int64_t end,
                         std::int64_t first, T* x, std::int64_t ldx, int sides);
  void (*backward_own)(const T* panel, std::int64_t ld, std::int64_t begin, std::int64_t end, T* x, std::int64_t ldx,
                       int sides);

  // Of three columns each, `lda` or `ldb` apart: g (few, 3 x 3, row by row) = A_m^T B of `few` such A, of which `a` and
  // `b` are the ends of the first columns, multiples of kPadding as the distances; what stands above the last `rows` of
  // a column, up to such a multiple, is finite. Then t (3) += A^T y; y -= A c.
  void (*gram3)(const T* const* a, const std::int64_t* lda, int few, const T* b, std::int64_t ldb, std::int64_t rows,
                double* g);
  void (*dots3)(const T* a, std::int64_t lda, const T* y, std::int64_t rows, double* t);
  void (*subtract3)(const T* a, std::int64_t lda, const double* c, T* y, std::int64_t rows);
  // G u for `count` (<= kTermBlock) terms u, G (length, length) with rows `ld` apart: out (length, kTermBlock), the
  // terms side by side, and what stands in `work` (kTermBlock, length) for those that lack; length a multiple of
  // kPadding. Then u^T of another term with all of them, kTermBlock sums.
  void (*multiply_terms)(const NodeTerm* const* terms, int count, const T* matrix, std::int64_t ld, std::int64_t length,
                         T* work, T* out);
  void (*dot_terms)(const NodeTerm& term, const T* products, double* sums);

  T (*dot)(const T* a, const T* b, std::int64_t n);
  void (*add_scaled)(T scale, const T* a, T* b, std::int64_t n);  // b += scale a

  const CompactKernels* compact;  // of float; else null
};

// The best level that runs here, or the one named. Throws std::invalid_argument.
template <class T>
const DenseKernels<T>& find_dense_kernels(const std::string& level = "");

template <class T>
const DenseKernels<T>* dense_kernels_SSE2();
template <class T>
const DenseKernels<T>* dense_kernels_AVX2();
template <class T>
const DenseKernels<T>* dense_kernels_AVX512();
template <class T>
const DenseKernels<T>* dense_kernels_NEON64();

}  // namespace qlb
