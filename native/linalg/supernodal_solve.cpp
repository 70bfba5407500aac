// The solves of SupernodalFactor.
#include <omp.h>

#include <algorithm>

#include "linalg/compact_layout.hpp"
#include "linalg/supernodal_factor.hpp"
#include "linalg/teamwork.hpp"
#include "simd/flush_subnormals.hpp"

namespace qlb {
namespace {

constexpr std::int64_t kSharedEntries = 400000;  // a panel of fewer entries is not worth the team's waiting
constexpr std::int64_t kRowsPerTask = 512, kColumnsPerTask = 16;

std::int64_t pieces(std::int64_t n, std::int64_t size) {
  return (n + size - 1) / size;
}

}  // namespace

// The vectors that supernode s passes up, rows_below(s) apart.
template <class T>
T* SupernodalFactor<T>::pending(std::int32_t s, int thread) {
  return (sides_.shared[s] ? shared_pending_ : thread_pending_[thread]).data() + sides_.offset[s];
}

// The front's own part of y, and what the children leave.
template <class T>
void SupernodalFactor<T>::gather_forward(std::int32_t s, int thread, const T* y, std::int64_t ld, int sides, T* x) {
  const std::int64_t columns = supernodes_.columns(s), below = supernodes_.rows_below(s);
  for (int r = 0; r < sides; ++r) {
    std::copy_n(y + supernodes_.first[s] + r * ld, columns, x + r * side_ld_);
    std::fill_n(x + columns + r * side_ld_, below, T(0));
  }
  for (const std::int32_t c : supernodes_.children(s)) {
    if (!on_path_.empty() && !on_path_[c]) continue;
    const std::int32_t* positions = supernodes_.positions(c);
    const std::int64_t rows = supernodes_.rows_below(c);
    for (int r = 0; r < sides; ++r) {
      const T* from = pending(c, thread) + r * rows;
      T* to = x + r * side_ld_;
      for (std::int64_t k = 0; k < rows; ++k) to[positions[k]] += from[k];
    }
  }
}

// x := what the front's columns make of it.
template <class T>
void SupernodalFactor<T>::forward_columns(std::int32_t s, bool shared, T* x, int sides) {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s);
  const T* L = panel(s);
  for (std::int64_t j = 0; j < columns; j += kWide) {
    const std::int64_t end = std::min<std::int64_t>(columns, j + kWide);
    const std::int64_t piece = shared ? kRowsPerTask : std::max<std::int64_t>(front - end, 1);
    once(shared, [&] { kernels_.forward_own(L, front, j, end, x, side_ld_, sides); });
    for_each(shared, pieces(front - end, piece), [&](std::int64_t k) {
      const std::int64_t first = end + k * piece;
      kernels_.forward_below(L, front, j, end, first, std::min(front, first + piece), x, side_ld_, sides);
    });
  }
}

template <>
void SupernodalFactor<double>::forward_compact(std::int32_t, bool, double*) {}  // there is none

template <>
void SupernodalFactor<float>::forward_compact(std::int32_t s, bool shared, float* x) {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s);
  const std::byte* block = compact_.data() + compact_begin_[s];
  for (std::int64_t j = 0; j < columns; j += kWide) {
    const CompactLayout layout{front, j, std::min<std::int64_t>(columns, j + kWide)};
    const std::int64_t end = layout.end, piece = shared ? kRowsPerTask : std::max<std::int64_t>(front - end, 1);
    once(shared, [&] { kernels_.compact->forward_own(layout, block, x); });
    for_each(shared, pieces(front - end, piece), [&](std::int64_t k) {
      const std::int64_t first = end + k * piece;
      kernels_.compact->forward_below(layout, block, first, std::min(front, first + piece), x);
    });
    block += layout.bytes();
  }
}

template <class T>
void SupernodalFactor<T>::forward_front(std::int32_t s, int thread, bool shared, T* y, std::int64_t ld, int sides) {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s);
  T* x = side_work(thread, shared);
  once(shared, [&] { gather_forward(s, thread, y, ld, sides, x); });
  if (is_compact(sides))
    forward_compact(s, shared, x);
  else
    forward_columns(s, shared, x, sides);
  once(shared, [&] {
    T* up = pending(s, thread);
    for (int r = 0; r < sides; ++r) {
      std::copy_n(x + r * side_ld_, columns, y + supernodes_.first[s] + r * ld);
      std::copy_n(x + columns + r * side_ld_, front - columns, up + r * (front - columns));
    }
  });
}

template <class T>
void SupernodalFactor<T>::gather_backward(std::int32_t s, const T* y, std::int64_t ld, int sides, T* x) {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s);
  const std::int32_t* rows = supernodes_.rows(s);
  for (int r = 0; r < sides; ++r) {
    T* to = x + r * side_ld_;
    const T* from = y + r * ld;
    std::copy_n(from + supernodes_.first[s], columns, to);
    for (std::int64_t k = 0; k < front - columns; ++k) to[columns + k] = from[rows[k]];
    std::fill_n(to + front, kPadding, T(0));
  }
}

template <class T>
void SupernodalFactor<T>::backward_columns(std::int32_t s, bool shared, T* x, int sides) {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s);
  const T* L = panel(s);
  for (std::int64_t j = (columns - 1) / kWide * kWide; j >= 0; j -= kWide) {
    const std::int64_t end = std::min<std::int64_t>(columns, j + kWide);
    const std::int64_t piece = shared ? kColumnsPerTask : end - j;
    for_each(shared, pieces(end - j, piece), [&](std::int64_t k) {
      const std::int64_t first = j + k * piece;
      kernels_.backward_above(L, front, front, first, std::min(end, first + piece), end, x, side_ld_, sides);
    });
    once(shared, [&] { kernels_.backward_own(L, front, j, end, x, side_ld_, sides); });
  }
}

template <>
void SupernodalFactor<double>::backward_compact(std::int32_t, bool, double*) {}

template <>
void SupernodalFactor<float>::backward_compact(std::int32_t s, bool shared, float* x) {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s);
  const std::byte* block = compact_.data() + compact_begin_[s + 1];
  for (std::int64_t j = (columns - 1) / kWide * kWide; j >= 0; j -= kWide) {
    const CompactLayout layout{front, j, std::min<std::int64_t>(columns, j + kWide)};
    block -= layout.bytes();
    for_each(shared, pieces(layout.end - j, kBlock),
             [&](std::int64_t k) { kernels_.compact->backward_above(layout, block, j + k * kBlock, x); });
    once(shared, [&] { kernels_.compact->backward_own(layout, block, x); });
  }
}

template <class T>
void SupernodalFactor<T>::backward_front(std::int32_t s, int thread, bool shared, T* y, std::int64_t ld, int sides) {
  T* x = side_work(thread, shared);
  once(shared, [&] { gather_backward(s, y, ld, sides, x); });
  if (is_compact(sides))
    backward_compact(s, shared, x);
  else
    backward_columns(s, shared, x, sides);
  once(shared, [&] {
    for (int r = 0; r < sides; ++r)
      std::copy_n(x + r * side_ld_, supernodes_.columns(s), y + supernodes_.first[s] + r * ld);
  });
}

template <class T>
void SupernodalFactor<T>::forward_team(T* y, std::int64_t ld, int sides) {
  const int thread = omp_get_thread_num();
  const FlushSubnormals flush;
  const auto subtrees = static_cast<std::int64_t>(solve_schedule_.subtrees.size());
#pragma omp for schedule(dynamic, 1)
  for (std::int64_t k = 0; k < subtrees; ++k)
    for (std::int32_t s = solve_schedule_.subtrees[k].first; s < solve_schedule_.subtrees[k].last; ++s)
      forward_front(s, thread, false, y, ld, sides);
  one_by_one(
      solve_schedule_.top.begin(), solve_schedule_.top.end(),
      [&](std::int32_t s) { return supernodes_.nonzeros(s) * sides > kSharedEntries; },
      [&](std::int32_t s, bool shared) { forward_front(s, thread, shared, y, ld, sides); },
      [](std::int32_t) { return false; });
}

template <class T>
void SupernodalFactor<T>::backward_team(T* y, std::int64_t ld, int sides) {
  const int thread = omp_get_thread_num();
  const FlushSubnormals flush;
  const auto subtrees = static_cast<std::int64_t>(solve_schedule_.subtrees.size());
  one_by_one(
      solve_schedule_.top.rbegin(), solve_schedule_.top.rend(),
      [&](std::int32_t s) { return supernodes_.nonzeros(s) * sides > kSharedEntries; },
      [&](std::int32_t s, bool shared) { backward_front(s, thread, shared, y, ld, sides); },
      [](std::int32_t) { return false; });
#pragma omp for schedule(dynamic, 1)
  for (std::int64_t k = 0; k < subtrees; ++k)
    for (std::int32_t s = solve_schedule_.subtrees[k].last; s-- > solve_schedule_.subtrees[k].first;)
      backward_front(s, thread, false, y, ld, sides);
}

template <class T>
void SupernodalFactor<T>::forward(T* y, std::int64_t ld, int sides) {
#pragma omp parallel num_threads(solve_threads_) if (solve_threads_ > 1)
  forward_team(y, ld, sides);
}

template <class T>
void SupernodalFactor<T>::backward(T* y, std::int64_t ld, int sides) {
#pragma omp parallel num_threads(solve_threads_) if (solve_threads_ > 1)
  backward_team(y, ld, sides);
}

template <class T>
void SupernodalFactor<T>::solve(T* y, std::int64_t ld, int sides) {
#pragma omp parallel num_threads(solve_threads_) if (solve_threads_ > 1)
  {
    forward_team(y, ld, sides);
    backward_team(y, ld, sides);
  }
}

template <class T>
void SupernodalFactor<T>::forward_along(std::span<const std::int32_t> path, T* y) {
  const FlushSubnormals flush;
  on_path_.assign(supernodes_.count(), 0);
  for (const std::int32_t s : path) on_path_[s] = 1;
  for (const std::int32_t s : path) forward_front(s, 0, false, y, 0, 1);
  on_path_.clear();
}

// Passes what changes straight to the rows of y: all of them lie on the path.
template <class T>
void SupernodalFactor<T>::forward_sides_front(std::int32_t s, T* sides, PathWork& work) const {
  const std::int64_t columns = supernodes_.columns(s), front = supernodes_.front(s), first = supernodes_.first[s];
  const T* L = panel(s);
  T* x = work.front.data();
  std::int64_t begin = columns;  // what is left of the first entry that is not zero changes nothing
  for (int r = 0; r < kRightSides; ++r) {
    const T* own = sides + first + r * work.ld;
    begin = std::min<std::int64_t>(begin, std::find_if(own, own + columns, [](T v) { return v != T(0); }) - own);
  }
  if (begin == columns) return;
  for (int r = 0; r < kRightSides; ++r) {
    std::copy_n(sides + first + r * work.ld, columns, x + r * side_ld_);
    std::fill_n(x + columns + r * side_ld_, front - columns, T(0));
  }
  for (std::int64_t j = begin / kBlock * kBlock; j < columns; j += kWide) {
    const std::int64_t end = std::min<std::int64_t>(columns, j + kWide);
    kernels_.forward_own(L, front, j, end, x, side_ld_, kRightSides);
    kernels_.forward_below(L, front, j, end, end, front, x, side_ld_, kRightSides);
  }
  const std::int32_t* rows = supernodes_.rows(s);
  for (int r = 0; r < kRightSides; ++r) {
    const T* from = x + r * side_ld_;
    T* to = sides + r * work.ld;
    std::copy_n(from, columns, to + first);
    for (std::int64_t k = 0; k < front - columns; ++k) to[rows[k]] += from[columns + k];
  }
}

template <class T>
void SupernodalFactor<T>::forward_sides_along(std::span<const std::int32_t> path, PathWork& work) const {
  const FlushSubnormals flush;
  for (const std::int32_t s : path)
    for (int r = 0; r < kPathSides; r += kRightSides) forward_sides_front(s, work.y.data() + r * work.ld, work);
}

template void SupernodalFactor<float>::forward_sides_along(std::span<const std::int32_t>, PathWork&) const;
template void SupernodalFactor<double>::forward_sides_along(std::span<const std::int32_t>, PathWork&) const;
template void SupernodalFactor<float>::forward(float*, std::int64_t, int);
template void SupernodalFactor<double>::forward(double*, std::int64_t, int);
template void SupernodalFactor<float>::backward(float*, std::int64_t, int);
template void SupernodalFactor<double>::backward(double*, std::int64_t, int);
template void SupernodalFactor<float>::solve(float*, std::int64_t, int);
template void SupernodalFactor<double>::solve(double*, std::int64_t, int);
template void SupernodalFactor<float>::forward_along(std::span<const std::int32_t>, float*);
template void SupernodalFactor<double>::forward_along(std::span<const std::int32_t>, double*);

}  // namespace qlb
