#include "linalg/woodbury_inverse.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace qlb {
namespace {
constexpr std::array<double, 3> kZero{};
const std::shared_ptr<const RankOneTerms> kNoTerms = std::make_shared<RankOneTerms>();
}  // namespace

WoodburyInverse::WoodburyInverse(std::shared_ptr<SupernodalCholesky> factor, std::shared_ptr<const TetBlocks> blocks,
                                 std::span<const std::uint8_t> fixed, int threads)
    : factor_(std::move(factor)),
      frame_(std::move(blocks), fixed, threads),
      threads_(std::max(threads, 1)),
      terms_(kNoTerms) {
  if (3 * frame_.nodes() != size()) throw std::invalid_argument("the mesh and the factor differ in size");
  right_.resize(size());
  solution_.resize(size());
}

void WoodburyInverse::carry(const double* x, const double* reference, double weight) {
  frame_.carry(x, reference, weight);
  if (terms() > 0 && !express_terms())
    throw std::runtime_error("with the new frame the matrix is not positive definite: set_terms first");
}

void WoodburyInverse::reset() {
  frame_.reset();
  if (terms() > 0 && !express_terms())
    throw std::runtime_error("with the new frame the matrix is not positive definite: set_terms first");
}

void WoodburyInverse::forget() {
  columns_ = std::monostate();
  version_ = -1;
  terms_ = kNoTerms;
  active_.clear();
  used_.clear();
}

std::int64_t WoodburyInverse::columns() const {
  return std::visit(
      []<class C>(const C& columns) -> std::int64_t {
        if constexpr (std::is_same_v<C, std::monostate>)
          return 0;
        else
          return columns->count();
      },
      columns_);
}

std::int64_t WoodburyInverse::bytes() const {
  return std::visit(
      []<class C>(const C& columns) -> std::int64_t {
        if constexpr (std::is_same_v<C, std::monostate>)
          return 0;
        else
          return columns->bytes();
      },
      columns_);
}

bool WoodburyInverse::set_terms(std::shared_ptr<const RankOneTerms> terms, std::int64_t framed) {
  terms->check_nodes(frame_.nodes());
  if (framed < 0 || framed > terms->size())
    throw std::invalid_argument("framed is " + std::to_string(framed) + ", must be 0 to the number of terms");
  factor_->check_ready();
  terms_ = std::move(terms);
  framed_ = framed;
  return express_terms();
}

void WoodburyInverse::pull_back(std::span<const std::int32_t> nodes, std::span<const double> vectors,
                                double* out) const {
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (nodes[k] < 0 || nodes[k] >= frame_.nodes())
      throw std::invalid_argument("nodes name node " + std::to_string(nodes[k]));
    const std::array<double, 3> v{vectors[3 * k], vectors[3 * k + 1], vectors[3 * k + 2]};
    std::ranges::copy(v == kZero ? v : frame_.pull_back_at(nodes[k], v), out + 3 * k);
  }
}

bool WoodburyInverse::express_terms() {
  const bool good =
      factor_->visit_factor([&]<class T>(const SupernodalFactor<T>&) { return express(columns_of<T>()); });
  if (!good) {
    terms_ = kNoTerms;
    active_.clear();
  }
  return good;
}

template <class T>
NodeColumns<T>& WoodburyInverse::columns_of() {
  using Columns = std::unique_ptr<NodeColumns<T>>;
  if (version_ != factor_->version() || !std::holds_alternative<Columns>(columns_)) {
    columns_ = factor_->make_columns<T>(threads_);
    version_ = factor_->version();
  }
  return *std::get<Columns>(columns_);
}

template <class T>
bool WoodburyInverse::express(NodeColumns<T>& columns) {
  std::vector<std::int32_t> nodes;
  for (std::int64_t j = 0; j < terms_->size(); ++j)
    for (int i = 0; i < 4; ++i)
      if (terms_->stiffness(j) != 0.0 && terms_->vector(j, i) != kZero) nodes.push_back(terms_->nodes(j)[i]);
  columns.make(nodes);

  active_.clear();
  used_.clear();
  for (std::int64_t j = 0; j < terms_->size(); ++j)
    if (const Active term = in_frame(columns, j); term.count > 0) {
      active_.push_back(term);
      used_.insert(used_.end(), term.column, term.column + term.count);
    }
  // An order that does not depend on which columns were made first: sums must not, to the last bit.
  std::sort(used_.begin(), used_.end(),
            [&](std::int32_t a, std::int32_t b) { return columns.first_row(a) < columns.first_row(b); });
  used_.erase(std::unique(used_.begin(), used_.end()), used_.end());
  std::vector<std::int32_t> place(columns.count());
  for (std::size_t k = 0; k < used_.size(); ++k) place[used_[k]] = static_cast<std::int32_t>(k);
  for (Active& term : active_)
    for (int i = 0; i < term.count; ++i) term.place[i] = place[term.column[i]];
  if (active_.empty()) return true;

  const auto negative =
      std::stable_partition(active_.begin(), active_.end(), [](const Active& a) { return a.positive; });
  positive_ = negative - active_.begin();
  columns.join(used_);
  in_double_ = std::is_same_v<T, double> || !factorise_small_matrix(columns, small_float_);
  return !in_double_ || factorise_small_matrix(columns, small_double_);
}

template <class T, class S>
bool WoodburyInverse::factorise_small_matrix(const NodeColumns<T>& columns, DenseCholesky<S>& small) {
  small.resize(active_terms(), positive_);
  form_small_matrix(columns, small);
  return small.factorise();
}

template <class T>
auto WoodburyInverse::in_frame(const NodeColumns<T>& columns, std::int64_t j) const -> Active {
  Active term;
  term.term = j;
  term.positive = terms_->stiffness(j) > 0.0;
  const double root = std::sqrt(std::abs(terms_->stiffness(j)));
  term.root = root;
  if (root == 0.0) return term;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t node = terms_->nodes(j)[i];
    if (terms_->vector(j, i) == kZero || columns.held(node)) continue;
    const std::int32_t column = columns.find(node);
    const bool framed = j >= terms_->size() - framed_;
    const std::array<double, 3> vector =
        framed ? terms_->vector(j, i) : frame_.pull_back_at(node, terms_->vector(j, i));
    const auto end = term.column + term.count;
    const auto at = std::find(term.column, end, column) - term.column;
    if (at == term.count) {
      term.column[term.count++] = column;
      std::fill_n(term.u[at], 3, 0.0);
    }
    for (int c = 0; c < 3; ++c) term.u[at][c] += root * vector[c];
  }
  return term;
}

// S_jl = sign_j delta_jl + sum over the nodes a of j and b of l of u_ja^T G_ab u_lb: for a block of rows j first all of
// G u_j.
template <class T, class S>
void WoodburyInverse::form_small_matrix(const NodeColumns<T>& columns, DenseCholesky<S>& small) const {
  const std::int64_t count = active_terms();
#pragma omp parallel num_threads(threads_) if (threads_ > 1 && count > 2 * kTermBlock)
  {
    Aligned<T> work(kTermBlock * columns.gram_length()), products(kTermBlock * columns.gram_length());
    std::array<const NodeTerm*, kTermBlock> block;
#pragma omp for schedule(dynamic, 1)
    for (std::int64_t first = 0; first < count; first += kTermBlock) {
      const std::int64_t end = std::min(first + kTermBlock, count);
      for (std::int64_t j = first; j < end; ++j) block[j - first] = &active_[j];
      columns.gram_products(std::span(block).first(end - first), work.data(), products.data());
      double sums[kTermBlock];
      for (std::int64_t l = 0; l < end; ++l) {
        columns.kernels().dot_terms(active_[l], products.data(), sums);
        const std::int64_t from = std::max(first, l);
        std::transform(sums + (from - first), sums + (end - first), small.column(l) + from,
                       [](double sum) { return static_cast<S>(sum); });
      }
      for (std::int64_t j = first; j < end; ++j) small.column(j)[j] += active_[j].positive ? S(1) : S(-1);
    }
  }
}

// scale y -= W c with c = S^-1 (W^T scale y - sign |K|^-1/2 beta), which stays in term_products_; no beta: zeros
template <class T>
void WoodburyInverse::correct(NodeColumns<T>& columns, const double* beta, T* y, double scale) {
  node_products_.resize(3 * used_.size());
  term_products_.resize(active_.size());
  columns.dots(used_, y, node_products_.data());
  for (std::size_t j = 0; j < active_.size(); ++j) {
    const Active& term = active_[j];
    double sum = 0.0;
    for (int i = 0; i < term.count; ++i)
      for (int c = 0; c < 3; ++c) sum += term.u[i][c] * node_products_[3 * term.place[i] + c];
    sum *= scale;
    if (beta != nullptr) sum -= (term.positive ? 1.0 : -1.0) / term.root * beta[term.term];
    term_products_[j] = sum;
  }
  if (in_double_)
    small_double_.solve(term_products_.data());
  else
    small_float_.solve(term_products_.data());
  std::fill(node_products_.begin(), node_products_.end(), 0.0);
  for (std::size_t j = 0; j < active_.size(); ++j) {
    const Active& term = active_[j];
    for (int i = 0; i < term.count; ++i)
      for (int c = 0; c < 3; ++c) node_products_[3 * term.place[i] + c] += term.u[i][c] * (term_products_[j] / scale);
  }
  columns.subtract(used_, node_products_.data(), y);
}

void WoodburyInverse::solve(const double* b, const double* beta, double* x) {
  if (!active_.empty() && version_ != factor_->version())
    throw std::logic_error("the factor was made anew since the terms were set: forget them and set them again");
  frame_.pull_back(b, right_.data());
  if (active_.empty())
    factor_->apply(right_.data(), solution_.data());
  else
    factor_->solve_with(right_.data(), solution_.data(), [&]<class T>(T* y, double scale) {
      correct(*std::get<std::unique_ptr<NodeColumns<T>>>(columns_), beta, y, scale);
    });
  frame_.push_forward(solution_.data(), x);
}

void WoodburyInverse::apply(const double* b, double* x) {
  solve(b, nullptr, x);
}

void WoodburyInverse::apply_split(const double* b, const RankOneTerms& terms, std::span<const std::int32_t> which,
                                  const double* beta, double* x, double* along) {
  if (terms.size() != terms_->size()) throw std::invalid_argument("the terms are not those that were set");
  // What is not in the small matrix has no stiffness (or no free node): its part of b is as small as any.
  active_of_.assign(terms.size(), -1);
  for (std::size_t k = 0; k < active_.size(); ++k) active_of_[active_[k].term] = static_cast<std::int32_t>(k);
  beta_.assign(terms.size(), 0.0);
  split_.assign(b, b + size());
  for (std::size_t k = 0; k < which.size(); ++k) {
    const std::int32_t j = which[k];
    if (active_of_[j] >= 0)
      beta_[j] = beta[k];
    else if (beta[k] != 0.0)
      terms.add_to(j, beta[k], split_.data());
  }
  solve(split_.data(), beta_.data(), x);
  // W^T (y - W c) = sign (|K|^-1/2 beta + c)
  for (std::size_t k = 0; k < which.size(); ++k) {
    const std::int32_t j = which[k];
    if (active_of_[j] < 0) {
      along[k] = terms.dot(j, x);
      continue;
    }
    const Active& active = active_[active_of_[j]];
    const double scaled = beta[k] / active.root + term_products_[active_of_[j]];
    along[k] = (active.positive ? scaled : -scaled) / active.root;
  }
}

}  // namespace qlb
