// Multifrontal Cholesky factorisation (Duff, Reid 1983; Liu 1992) and its solves, in precision T.
//
// The front of a supernode gathers its columns of A and the update matrices of its children. Eliminating its columns
// leaves its panel of L and its own update matrix, -L21 L21^T plus what it received, which waits for the parent.
// Solves do the same with vectors. Every sum has one order, so no bit depends on the number of threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "assembly/block_pattern.hpp"
#include "linalg/dense_kernels.hpp"
#include "linalg/front_schedule.hpp"
#include "linalg/huge_buffer.hpp"
#include "linalg/supernodes.hpp"

namespace qlb {

// Where each entry of BlockMatrix::values() goes, for the supernode that holds it.
struct AssemblyMap {
  struct Block {  // a whole 3 x 3 block, off the diagonal
    std::int32_t block, row, column;
    bool transposed;
  };
  struct Entry {
    std::int64_t value;
    std::int32_t row, column;
  };
  std::vector<std::int64_t> block_begin, entry_begin;  // supernodes + 1
  std::vector<Block> blocks;
  std::vector<Entry> entries;
};

AssemblyMap map_assembly(const Supernodes& supernodes, const BlockPattern& pattern);

template <class T>
class SupernodalFactor {
 public:
  // compact: solves for one vector read a copy of L in 16 bits (compact_layout.hpp); for T = float alone.
  SupernodalFactor(const Supernodes& supernodes, const BlockPattern& pattern, int threads, const std::string& simd,
                   bool compact = false);

  // Returns the first column, in elimination order, whose pivot is not positive or not finite, or -1.
  std::int64_t factorise(const double* values);

  // y := L^-1 y and y := L^-T y for `sides` (1 or kRightSides) vectors in elimination order, `ld` apart.
  void forward(T* y, std::int64_t ld, int sides);
  void backward(T* y, std::int64_t ld, int sides);
  void solve(T* y, std::int64_t ld, int sides);  // one after the other
  // y := L^-1 y over some supernodes only, ascending, with all their ancestors; y is zero in all others.
  void forward_along(std::span<const std::int32_t> path, T* y);

  // As forward_along for kPathSides vectors, work.y, in a work space of the caller's: one factor may serve several
  // threads. The bits of a vector do not depend on the others, nor on supernodes of the path where it is zero.
  static constexpr int kPathSides = 3 * kRightSides;  // one after the other while a panel is in the cache
  struct PathWork {
    explicit PathWork(const SupernodalFactor& factor)
        : ld(factor.supernodes_.first.back()), y(kPathSides * ld), front(kRightSides * factor.side_ld_) {}
    std::int64_t ld;  // rows of y
    HugeBuffer<T> y, front;
  };
  void forward_sides_along(std::span<const std::int32_t> path, PathWork& work) const;

  const DenseKernels<T>& kernels() const { return kernels_; }
  std::int64_t bytes() const { return static_cast<std::int64_t>(panels_.bytes() + compact_.bytes()); }
  std::int64_t compact_bytes() const { return compact_.size(); }  // 0 without

 private:
  T* panel(std::int32_t s) { return panels_.data() + panel_begin_[s]; }
  const T* panel(std::int32_t s) const { return panels_.data() + panel_begin_[s]; }
  bool is_compact(int sides) const { return compact_.size() > 0 && sides == 1; }
  void forward_sides_front(std::int32_t s, T* sides, PathWork& work) const;
  T* update(std::int32_t s, int thread);
  T* pending(std::int32_t s, int thread);
  std::int64_t update_ld(std::int32_t s) const;

  void plan(int threads);
  void eliminate_front(std::int32_t s, int thread, bool shared);
  void assemble(std::int32_t s, const double* values, bool shared);
  void add_children(std::int32_t s, int thread, bool shared, bool into_panel);
  int factor_panel(std::int32_t s, int thread, bool shared);
  int factor_wide_panel(std::int32_t s, int thread, bool shared);
  void make_update(std::int32_t s, int thread, bool shared);
  void pack_panel(std::int32_t s, bool shared);
  void report(std::int64_t column);

  void gather_forward(std::int32_t s, int thread, const T* y, std::int64_t ld, int sides, T* x);
  void gather_backward(std::int32_t s, const T* y, std::int64_t ld, int sides, T* x);
  void forward_team(T* y, std::int64_t ld, int sides);
  void backward_team(T* y, std::int64_t ld, int sides);
  void forward_front(std::int32_t s, int thread, bool shared, T* y, std::int64_t ld, int sides);
  void backward_front(std::int32_t s, int thread, bool shared, T* y, std::int64_t ld, int sides);
  void forward_columns(std::int32_t s, bool shared, T* x, int sides);
  void backward_columns(std::int32_t s, bool shared, T* x, int sides);
  void forward_compact(std::int32_t s, bool shared, T* x);
  void backward_compact(std::int32_t s, bool shared, T* x);
  T* side_work(int thread, bool shared) { return (shared ? shared_sides_ : side_work_[thread]).data(); }

  const Supernodes& supernodes_;
  const DenseKernels<T>& kernels_;
  AssemblyMap map_;
  std::vector<std::int64_t> panel_begin_, compact_begin_;
  HugeBuffer<T> panels_;
  HugeBuffer<std::byte> compact_;
  int factor_threads_, solve_threads_;  // as many as pay

  Schedule factor_schedule_, solve_schedule_;
  Placement updates_, sides_;  // of update matrices; of the vectors that solves pass up
  HugeBuffer<T> shared_updates_, shared_pending_, shared_sides_;
  std::vector<HugeBuffer<T>> thread_updates_, thread_pending_, work_, side_work_;
  std::vector<std::uint8_t> on_path_;
  const double* values_ = nullptr;
  std::int64_t side_ld_ = 0;
  std::atomic<std::int64_t> failed_{0};
  std::vector<int> bad_;  // of each thread's panel; the first also of a panel that is shared
};

}  // namespace qlb
