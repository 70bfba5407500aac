#include "linalg/node_columns.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace qlb {
namespace {
constexpr std::int64_t kRowsPerTask = 1024, kColumnsPerTask = 8;
constexpr double kNotMade = std::numeric_limits<double>::quiet_NaN();
}  // namespace

template <class T>
NodeColumns<T>::NodeColumns(const Supernodes& supernodes, const SupernodalFactor<T>& factor,
                            std::span<const std::int32_t> row_of_dof, std::span<const std::int32_t> owner, int threads)
    : supernodes_(supernodes),
      factor_(factor),
      row_of_dof_(row_of_dof),
      owner_(owner),
      threads_(threads),
      rows_to_root_(supernodes.count()),
      column_of_node_(row_of_dof.size() / 3, -1) {
  for (std::int32_t s = supernodes.count(); s-- > 0;)
    rows_to_root_[s] =
        supernodes.columns(s) + (supernodes.parent[s] >= 0 ? rows_to_root_[supernodes.parent[s]] : std::int64_t{0});
}

template <class T>
bool NodeColumns<T>::held(std::int32_t node) const {
  const std::int32_t* row = &row_of_dof_[3 * static_cast<std::int64_t>(node)];
  return row[0] < 0 && row[1] < 0 && row[2] < 0;
}

template <class T>
std::int64_t NodeColumns<T>::bytes() const {
  std::int64_t sum = static_cast<std::int64_t>(gram_.size() * sizeof(double));
  for (const Column& column : columns_) sum += static_cast<std::int64_t>(column.values.size() * sizeof(T));
  return sum;
}

template <class T>
template <class F>
void NodeColumns<T>::for_each_range(const Column& column, const F& f) const {
  std::int64_t first = column.first, place = 0;
  for (std::int32_t s = column.supernode; s >= 0;) {
    std::int64_t end = supernodes_.first[s + 1];
    s = supernodes_.parent[s];
    if (s >= 0 && supernodes_.first[s] == end) continue;  // goes on without a gap
    f(first, place, end - first);
    place += end - first;
    if (s >= 0) first = supernodes_.first[s];
  }
}

// Room for the columns of new nodes; returns what is to be solved for, in elimination order.
template <class T>
auto NodeColumns<T>::add_columns(std::span<const std::int32_t> nodes) -> std::vector<Side> {
  std::vector<Side> sides;
  for (const std::int32_t node : nodes) {
    if (held(node) || find(node) >= 0) continue;
    const auto id = static_cast<std::int32_t>(columns_.size());
    column_of_node_[node] = id;
    std::int64_t first = std::numeric_limits<std::int64_t>::max();
    for (int axis = 0; axis < 3; ++axis)
      if (const std::int64_t row = row_of_dof_[3 * static_cast<std::int64_t>(node) + axis]; row >= 0) {
        sides.push_back({row, id, axis});
        first = std::min(first, row);
      }
    const std::int32_t s = owner_[first];
    const std::int64_t rows = rows_to_root_[s] - (first - supernodes_.first[s]);
    const std::int64_t ld = (rows + 2 * kPadding - 1) / kPadding * kPadding;
    columns_.push_back({s, first, rows, ld, Aligned<T>(3 * ld, T(0))});
    joined_.push_back(0);
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.row < b.row; });
  return sides;
}

template <class T>
std::vector<std::int32_t> NodeColumns<T>::union_of_paths(std::span<const Side> sides) const {
  std::vector<std::int32_t> path;
  for (const Side& side : sides)
    for (std::int32_t s = columns_[side.column].supernode; s >= 0; s = supernodes_.parent[s]) path.push_back(s);
  std::sort(path.begin(), path.end());
  path.erase(std::unique(path.begin(), path.end()), path.end());
  return path;
}

template <class T>
void NodeColumns<T>::solve_sides(std::span<const Side> sides, typename SupernodalFactor<T>::PathWork& work) {
  const std::vector<std::int32_t> path = union_of_paths(sides);
  T* y = work.y.data();
  for (std::size_t r = 0; r < sides.size(); ++r) y[sides[r].row + r * work.ld] = T(1);
  factor_.forward_sides_along(path, work);
  for (std::size_t r = 0; r < sides.size(); ++r) {
    Column& column = columns_[sides[r].column];
    T* to = column.values.data() + sides[r].axis * column.ld;
    for_each_range(column, [&](std::int64_t first, std::int64_t place, std::int64_t rows) {
      std::copy_n(y + first + r * work.ld, rows, to + place);
    });
  }
  for (std::size_t r = 0; r < sides.size(); ++r)
    for (const std::int32_t s : path)
      std::fill(y + supernodes_.first[s] + r * work.ld, y + supernodes_.first[s + 1] + r * work.ld, T(0));
}

template <class T>
void NodeColumns<T>::make(std::span<const std::int32_t> nodes) {
  const std::vector<Side> sides = add_columns(nodes);
  const auto batches = (static_cast<std::int64_t>(sides.size()) + kRightSides - 1) / kRightSides;
  if (batches == 0) return;
  while (static_cast<int>(work_.size()) < threads_) work_.emplace_back(factor_);
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_) if (batches > 1 && threads_ > 1)
  for (std::int64_t k = 0; k < batches; ++k) {
    const std::size_t begin = k * kRightSides;
    solve_sides(std::span(sides).subspan(begin, std::min<std::size_t>(kRightSides, sides.size() - begin)),
                work_[omp_get_thread_num()]);
  }
}

// Up to the root, from the first supernode of both on.
template <class T>
std::int64_t NodeColumns<T>::common_rows(const Column& a, const Column& b) const {
  std::int32_t s = a.supernode, other = b.supernode;
  while (s != other) {
    std::int32_t& lower = s < other ? s : other;
    lower = supernodes_.parent[lower];
    if (lower < 0) return 0;
  }
  return std::min({a.rows, b.rows, rows_to_root_[s]});
}

template <class T>
void NodeColumns<T>::make_gram(std::int32_t i, std::int32_t j) {
  const Column &a = columns_[i], &b = columns_[j];
  double g[9] = {};
  const std::int64_t rows = common_rows(a, b);
  if (rows > 0)
    factor_.kernels().gram3(a.values.data() + a.rows - rows, a.ld, b.values.data() + b.rows - rows, b.ld, rows, g);
  const std::int64_t ld = 3 * capacity_, at_i = 3 * std::int64_t{i}, at_j = 3 * std::int64_t{j};
  for (int c = 0; c < 3; ++c)
    for (int d = 0; d < 3; ++d) gram_[(at_i + c) * ld + at_j + d] = gram_[(at_j + d) * ld + at_i + c] = g[3 * c + d];
}

template <class T>
void NodeColumns<T>::reserve_gram() {
  if (count() <= capacity_) return;
  const std::int64_t wanted = std::max({std::int64_t{32}, count(), capacity_ + capacity_ / 2});
  const std::int64_t capacity = (wanted + kPadding - 1) / kPadding * kPadding, ld = 3 * capacity_;
  Aligned<double> gram(9 * capacity * capacity, kNotMade);
  for (std::int64_t k = 0; k < ld; ++k) std::copy_n(gram_.data() + k * ld, ld, gram.data() + k * 3 * capacity);
  gram_ = std::move(gram);
  capacity_ = capacity;
}

template <class T>
void NodeColumns<T>::join(std::span<const std::int32_t> columns) {
  reserve_gram();
  std::vector<std::int32_t> ids(columns.begin(), columns.end());
  std::sort(ids.begin(), ids.end(),
            [&](std::int32_t a, std::int32_t b) { return joined_[a] != joined_[b] ? joined_[a] > joined_[b] : a < b; });
  const auto count = static_cast<std::int64_t>(ids.size());
  const std::int64_t known =
      std::find_if(ids.begin(), ids.end(), [&](std::int32_t k) { return !joined_[k]; }) - ids.begin();
  // A few columns stay in the cache while the others pass by.
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_) if (threads_ > 1)
  for (std::int64_t first = known; first < count; first += kColumnsPerTask) {
    const std::int64_t last = std::min(count, first + kColumnsPerTask);
    for (std::int64_t b = 0; b < last; ++b)
      for (std::int64_t a = std::max(first, b); a < last; ++a)
        if (std::isnan(*(gram_row(ids[a], 0) + 3 * std::int64_t{ids[b]}))) make_gram(ids[a], ids[b]);
  }
  std::fill(joined_.begin(), joined_.end(), 0);
  for (const std::int32_t k : ids) joined_[k] = 1;
}

template <class T>
void NodeColumns<T>::gram_product(const std::int32_t* columns, const double* u, int few, double* out) const {
  const double* rows[4];
  for (int k = 0; k < few; ++k) rows[k] = gram_row(columns[k], 0);
  // Whole vectors, so that a column's entries are summed in one way wherever it stands.
  const std::int64_t length = (3 * count() + kPadding - 1) / kPadding * kPadding;
  factor_.kernels().combine3(rows, gram_length(), u, few, length, out);
}

template <class T>
void NodeColumns<T>::dots(std::span<const std::int32_t> columns, const T* y, double* t) const {
  const auto count = static_cast<std::int64_t>(columns.size());
#pragma omp parallel for schedule(static) num_threads(threads_) if (threads_ > 1 && count > 64)
  for (std::int64_t k = 0; k < count; ++k) {
    const Column& column = columns_[columns[k]];
    std::fill_n(t + 3 * k, 3, 0.0);
    for_each_range(column, [&](std::int64_t first, std::int64_t place, std::int64_t rows) {
      factor_.kernels().dots3(column.values.data() + place, column.ld, y + first, rows, t + 3 * k);
    });
  }
}

// Threads share the rows, so each row takes its columns in one order.
template <class T>
void NodeColumns<T>::subtract(std::span<const std::int32_t> columns, const double* c, T* y) const {
  const std::int64_t size = supernodes_.first.back();
  const std::int64_t tasks = threads_ > 1 && columns.size() > 64 ? (size + kRowsPerTask - 1) / kRowsPerTask : 1;
  const std::int64_t rows_per_task = tasks > 1 ? kRowsPerTask : size;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads_) if (tasks > 1)
  for (std::int64_t task = 0; task < tasks; ++task) {
    const std::int64_t begin = task * rows_per_task, end = begin + rows_per_task;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const Column& column = columns_[columns[k]];
      for_each_range(column, [&](std::int64_t first, std::int64_t place, std::int64_t rows) {
        const std::int64_t from = std::max(first, begin), to = std::min(first + rows, end);
        if (from < to)
          factor_.kernels().subtract3(column.values.data() + place + from - first, column.ld, c + 3 * k, y + from,
                                      to - from);
      });
    }
  }
}

template class NodeColumns<float>;
template class NodeColumns<double>;

}  // namespace qlb
