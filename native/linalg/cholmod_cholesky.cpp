#include "linalg/cholmod_cholesky.hpp"

#include <cblas.h>
#include <cholmod.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "linalg/ordering.hpp"

namespace qlb {
namespace {

// Below this many operations a second BLAS thread costs more than it brings (seen at 12k tets, 0.4e9).
constexpr double kThreadedFlops = 1e9;

// CHOLMOD 3 opens a team of four OpenMP threads, a constant of its build, for each supernode, which on small
// fronts costs several times the arithmetic. Within this scope its parallel regions run on one thread; BLAS
// keeps its own.
class SerialOpenMp {
 public:
  SerialOpenMp() { omp_set_max_active_levels(0); }
  ~SerialOpenMp() { omp_set_max_active_levels(levels_); }

 private:
  int levels_ = omp_get_max_active_levels();
};

}  // namespace

struct CholmodCholesky::State {
  cholmod_common common;
  cholmod_sparse* matrix = nullptr;
  cholmod_factor* factor = nullptr;
  cholmod_dense *right = nullptr, *solution = nullptr, *work_y = nullptr, *work_e = nullptr;

  State() {
    cholmod_l_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_ll = 1;
    common.quick_return_if_not_posdef = 1;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_NATURAL;  // rows come in elimination order; CHOLMOD adds a postorder
    common.postorder = 1;
  }
  ~State() {
    cholmod_l_free_dense(&right, &common);
    cholmod_l_free_dense(&solution, &common);
    cholmod_l_free_dense(&work_y, &common);
    cholmod_l_free_dense(&work_e, &common);
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_free_sparse(&matrix, &common);
    cholmod_l_finish(&common);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void check(const char* what) const {
    if (common.status >= CHOLMOD_OK) return;
    if (common.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
    throw std::runtime_error(std::string("CHOLMOD failed to ") + what + " (status " + std::to_string(common.status) +
                             ")");
  }
};

CholmodCholesky::CholmodCholesky(std::shared_ptr<const BlockPattern> pattern, std::span<const std::uint8_t> fixed,
                                 int threads)
    : pattern_(std::move(pattern)), threads_(threads), state_(std::make_unique<State>()) {
  if (static_cast<std::int64_t>(fixed.size()) != size())
    throw std::invalid_argument("fixed must have one entry per degree of freedom");
  dof_ = free_dofs(nested_dissection(*pattern_, fixed), fixed);
  if (dof_.empty()) return;
  build_matrix(fixed);
  State& s = *state_;
  s.factor = cholmod_l_analyze(s.matrix, &s.common);
  s.check("analyse the matrix");
  factor_nonzeros_ = static_cast<std::int64_t>(s.common.lnz);
  factor_flops_ = s.common.fl;
  blas_threads_ = factor_flops_ < kThreadedFlops ? 1 : threads_;
  const std::size_t n = dof_.size();
  s.right = cholmod_l_allocate_dense(n, 1, n, CHOLMOD_REAL, &s.common);
  s.check("allocate a vector");
}

CholmodCholesky::~CholmodCholesky() = default;

// The lower triangle in elimination order, by columns, rows ascending.
void CholmodCholesky::build_matrix(std::span<const std::uint8_t> fixed) {
  const std::int64_t n = static_cast<std::int64_t>(dof_.size());
  std::vector<std::int64_t> rank(size(), -1);
  for (std::int64_t k = 0; k < n; ++k) rank[dof_[k]] = k;

  const auto for_each_entry = [&](auto&& visit) {
    for (std::int64_t j = 0; j < pattern_->nodes(); ++j)
      for (std::int64_t k = pattern_->column_begin()[j]; k < pattern_->column_begin()[j + 1]; ++k) {
        const std::int64_t i = pattern_->rows()[k];
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < (i == j ? a + 1 : 3); ++b)
            if (!fixed[3 * i + a] && !fixed[3 * j + b]) {
              const auto [column, row] = std::minmax(rank[3 * i + a], rank[3 * j + b]);
              visit(row, column, 9 * k + 3 * a + b);
            }
      }
  };
  std::vector<std::int64_t> begin(n + 1, 0);
  for_each_entry([&](std::int64_t, std::int64_t column, std::int64_t) { ++begin[column + 1]; });
  for (std::int64_t j = 0; j < n; ++j) begin[j + 1] += begin[j];
  std::vector<std::pair<std::int64_t, std::int64_t>> entries(begin[n]);  // row, source
  std::vector<std::int64_t> next(begin.begin(), begin.end());
  for_each_entry(
      [&](std::int64_t row, std::int64_t column, std::int64_t source) { entries[next[column]++] = {row, source}; });

  State& s = *state_;
  s.matrix = cholmod_l_allocate_sparse(n, n, begin[n], 1, 1, -1, CHOLMOD_REAL, &s.common);
  s.check("allocate the matrix");
  std::copy(begin.begin(), begin.end(), static_cast<SuiteSparse_long*>(s.matrix->p));
  auto* rows = static_cast<SuiteSparse_long*>(s.matrix->i);
  entry_.resize(entries.size());
  for (std::int64_t j = 0; j < n; ++j) {
    std::sort(entries.begin() + begin[j], entries.begin() + begin[j + 1]);
    for (std::int64_t k = begin[j]; k < begin[j + 1]; ++k) rows[k] = entries[k].first, entry_[k] = entries[k].second;
  }
}

// The first column with an entry that is not a number, which LAPACK would let pass; -1 if there is none.
std::int64_t CholmodCholesky::first_not_finite() const {
  const auto* values = static_cast<const double*>(state_->matrix->x);
  const auto* begin = static_cast<const SuiteSparse_long*>(state_->matrix->p);
  for (std::size_t column = 0; column < dof_.size(); ++column)
    for (SuiteSparse_long k = begin[column]; k < begin[column + 1]; ++k)
      if (!std::isfinite(values[k])) return static_cast<std::int64_t>(column);
  return -1;
}

std::int64_t CholmodCholesky::factorise(const BlockMatrix& matrix) {
  if (&matrix.pattern() != pattern_.get())
    throw std::invalid_argument("the matrix has another pattern than the factor");
  ready_ = true;
  if (dof_.empty()) return kPositiveDefinite;
  State& s = *state_;
  auto* values = static_cast<double*>(s.matrix->x);
  const auto count = static_cast<std::int64_t>(entry_.size());
#pragma omp parallel for schedule(static) num_threads(threads_)
  for (std::int64_t k = 0; k < count; ++k) values[k] = matrix.values()[entry_[k]];
  ready_ = false;
  if (const std::int64_t column = first_not_finite(); column >= 0) return dof_[column];

  openblas_set_num_threads(blas_threads_);
  const SerialOpenMp serial;
  cholmod_l_factorize(s.matrix, s.factor, &s.common);
  s.check("factorise the matrix");
  if (s.factor->minor < s.factor->n) {
    const auto* postorder = static_cast<SuiteSparse_long*>(s.factor->Perm);
    return dof_[postorder ? postorder[s.factor->minor] : static_cast<SuiteSparse_long>(s.factor->minor)];
  }
  ready_ = true;
  return kPositiveDefinite;
}

void CholmodCholesky::apply(const double* b, double* x) {
  if (!ready_) throw std::logic_error("solve without a factor: factorise first");
  std::fill(x, x + size(), 0.0);
  if (dof_.empty()) return;
  State& s = *state_;
  auto* right = static_cast<double*>(s.right->x);
  const auto n = static_cast<std::int64_t>(dof_.size());
  for (std::int64_t k = 0; k < n; ++k) right[k] = b[dof_[k]];
  openblas_set_num_threads(blas_threads_);
  const SerialOpenMp serial;
  cholmod_l_solve2(CHOLMOD_A, s.factor, s.right, nullptr, &s.solution, nullptr, &s.work_y, &s.work_e, &s.common);
  s.check("solve");
  const auto* solution = static_cast<const double*>(s.solution->x);
  for (std::int64_t k = 0; k < n; ++k) x[dof_[k]] = solution[k];
}

}  // namespace qlb
