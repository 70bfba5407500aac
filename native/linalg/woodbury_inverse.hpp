// (A + C K C^T)^-1 for the carried factor A^-1 = T (L L^T)^-1 T^T (CarriedInverse) and rank-one terms, by Woodbury:
//
//   (A + C K C^T)^-1 = A^-1 - A^-1 C (K^-1 + C^T A^-1 C)^-1 C^T A^-1
//
// All is done between the two half-solves. With W = L^-1 P T^T C |K|^1/2 and S = sign(K) + W^T W, the result is
// T P^T L^-T (1 - W S^-1 W^T) L^-1 P T^T. W is never formed: it is put together from NodeColumns, and W^T W from their
// products.
#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "linalg/dense_cholesky.hpp"
#include "linalg/material_frame.hpp"
#include "linalg/node_columns.hpp"
#include "linalg/rank_one_terms.hpp"
#include "linalg/supernodal_cholesky.hpp"

namespace qlb {

class WoodburyInverse : public InverseOperator {
 public:
  // fixed: (nodes, 3), as the factor has it; a node with a held axis keeps T = 1.
  WoodburyInverse(std::shared_ptr<SupernodalCholesky> factor, std::shared_ptr<const TetBlocks> blocks,
                  std::span<const std::uint8_t> fixed, int threads);

  // T from how the material has moved between `reference`, where A was factorised, and x; T = 1. The terms stay.
  void carry(const double* x, const double* reference, double weight);
  void reset();

  // Replaces the terms; negative ones take away. The last `framed` of them are in the frame of the factor as they are.
  // Returns false, and goes on without any, where the sum is not positive definite: with negative terms alone can that
  // be.
  bool set_terms(std::shared_ptr<const RankOneTerms> terms, std::int64_t framed = 0);
  // T_i^T a_i at the nodes of each term, a of shape (terms, 4, 3).
  void pull_back(std::span<const std::int32_t> nodes, std::span<const double> vectors, double* out) const;
  // Drops the terms and all that was kept: for when the factor is made anew.
  void forget();

  std::int64_t size() const override { return factor_->size(); }
  void apply(const double* b, double* x) override;
  // `terms` are those that were set. With W and S as above, S^-1 (W^T y - sign |K|^-1/2 beta) takes the place of
  // S^-1 W^T y, so that stiff terms cancel nothing.
  void apply_split(const double* b, const RankOneTerms& terms, std::span<const std::int32_t> which, const double* beta,
                   double* x, double* along) override;

  std::int64_t terms() const { return terms_->size(); }
  std::int64_t active_terms() const { return static_cast<std::int64_t>(active_.size()); }  // those not wholly held
  std::int64_t columns() const;  // nodes whose half-solves are kept
  std::int64_t bytes() const;    // that they and their products take

 private:
  // A term in the frame of the factor: |k|^1/2 T_i^T a_i at up to four of NodeColumns.
  struct Active : NodeTerm {
    std::int64_t term = 0;  // its number in terms_
    double root = 0.0;      // |k|^1/2
    bool positive = true;
    std::int32_t place[4];  // of its columns among those in use
  };
  using AnyColumns =
      std::variant<std::monostate, std::unique_ptr<NodeColumns<float>>, std::unique_ptr<NodeColumns<double>>>;
  bool express_terms();
  template <class T>
  NodeColumns<T>& columns_of();
  template <class T>
  bool express(NodeColumns<T>& columns);
  template <class T>
  Active in_frame(const NodeColumns<T>& columns, std::int64_t term) const;
  template <class T, class S>
  bool factorise_small_matrix(const NodeColumns<T>& columns, DenseCholesky<S>& small);
  template <class T, class S>
  void form_small_matrix(const NodeColumns<T>& columns, DenseCholesky<S>& small) const;
  template <class T>
  void correct(NodeColumns<T>& columns, const double* beta, T* y, double scale);
  void solve(const double* b, const double* beta, double* x);

  std::shared_ptr<SupernodalCholesky> factor_;
  MaterialFrame frame_;
  int threads_;
  AnyColumns columns_;
  std::int64_t version_ = -1;  // of the factor that the columns belong to
  std::shared_ptr<const RankOneTerms> terms_;
  std::int64_t framed_ = 0;         // how many of the last terms are in the frame of the factor
  std::vector<Active> active_;      // the positive ones first
  std::vector<std::int32_t> used_;  // columns in use, in elimination order
  // S, as exact as the factor; where that is not enough to be definite, in double precision.
  DenseCholesky<float> small_float_;
  DenseCholesky<double> small_double_;
  bool in_double_ = true;
  std::int64_t positive_ = 0;  // active terms with k > 0
  std::vector<double> node_products_, term_products_, beta_;
  std::vector<std::int32_t> active_of_;  // of each term: its place in active_, or -1
  Aligned<double> right_, solution_, split_;
};

}  // namespace qlb
