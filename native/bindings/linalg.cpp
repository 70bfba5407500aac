#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include "bindings/bindings.hpp"
#include "bindings/rows.hpp"

#include "linalg/carried_inverse.hpp"
#include "linalg/lbfgs.hpp"
#include "linalg/supernodal_cholesky.hpp"
#include "linalg/vector_ops.hpp"

namespace qlb {
namespace {

constexpr std::array<std::pair<const char*, Precision>, 3> kPrecisions{
    {{"compact", Precision::compact}, {"float32", Precision::float32}, {"float64", Precision::float64}}};

Precision precision_named(const std::string& name) {
  for (const auto& [known, precision] : kPrecisions)
    if (name == known) return precision;
  throw std::invalid_argument("precision is 'compact', 'float32' or 'float64', not '" + name + "'");
}

void bind_half_solves(nb::class_<SupernodalCholesky, Cholesky>& type) {
  type.def(
          "forward",
          [](SupernodalCholesky& f, const Array<const double>& b, const Array<double>& y) {
            f.forward(sized(b, f.size(), "b"), sized(y, f.rows(), "y"));
          },
          nb::arg("b"), nb::arg("y").noconvert(), ReleaseGil(), "y = L^-1 P b, y in elimination order.")
      .def(
          "backward",
          [](SupernodalCholesky& f, const Array<const double>& y, const Array<double>& x) {
            f.backward(sized(y, f.rows(), "y"), sized(x, f.size(), "x"));
          },
          nb::arg("y"), nb::arg("x").noconvert(), ReleaseGil(), "x = P^T L^-T y, y in elimination order.")
      .def(
          "set_precision",
          [](SupernodalCholesky& f, const std::string& precision) { f.set_precision(precision_named(precision)); },
          nb::arg("precision"), "Go on in another precision; the factor in place is lost.")
      .def_prop_ro("precision",
                   [](const SupernodalCholesky& f) { return kPrecisions[static_cast<int>(f.precision())].first; })
      .def(
          "forward_sparse",
          [](SupernodalCholesky& f, const Array<const std::int64_t>& dofs, const Array<const double>& values) {
            SupernodalCholesky::Sparse y = f.forward_sparse(view(dofs), view(values));
            return std::pair(numpy(std::move(y.row)), numpy(std::move(y.value)));
          },
          nb::arg("dofs"), nb::arg("values"),
          "(rows, values) of y = L^-1 P b, for b zero but at `dofs`; rows in elimination order, ascending.");
}

void bind_supernodal(nb::module_& m) {
  nb::class_<SupernodalCholesky, Cholesky> type(m, "SupernodalCholesky");
  type.def(
          "__init__",
          [](SupernodalCholesky* self, std::shared_ptr<BlockPattern> pattern, const Array<const std::uint8_t>& fixed,
             int threads, const std::string& precision, const std::string& simd,
             const std::optional<Array<const std::int32_t>>& order) {
            new (self) SupernodalCholesky(std::move(pattern), view(fixed), threads, precision_named(precision), simd,
                                          order ? view(*order) : std::span<const std::int32_t>());
          },
          nb::arg("pattern"), nb::arg("fixed"), nb::arg("threads"), nb::arg("precision"), nb::arg("simd") = "",
          nb::arg("order") = nb::none(), ReleaseGil(),
          "order: all nodes, shape (n,), in the order of elimination; without it nested dissection (METIS) finds one.")
      .def(
          "solve",
          [](SupernodalCholesky& f, const Array<const double>& b, const Array<double>& x) {
            if (b.size() % f.size() != 0) throw std::invalid_argument("b must hold whole right-hand sides");
            const auto count = static_cast<std::int64_t>(b.size()) / f.size();
            f.solve(b.data(), sized(x, count * f.size(), "x"), count);
          },
          nb::arg("b"), nb::arg("x").noconvert(), ReleaseGil(),
          "Several right-hand sides, one after the other in b and x: shape (count, nodes, 3).")
      .def_prop_ro("rows", &SupernodalCholesky::rows, "Free degrees of freedom.")
      .def_prop_ro(
          "order",
          [](const SupernodalCholesky& f) {
            return numpy(std::vector<std::int64_t>(f.order().begin(), f.order().end()));
          },
          nb::rv_policy::move, "Degree of freedom of each row in elimination order.")
      .def_prop_ro(
          "node_order",
          [](const SupernodalCholesky& f) {
            return numpy(std::vector<std::int32_t>(f.node_order().begin(), f.node_order().end()));
          },
          nb::rv_policy::move,
          "Order of all nodes, shape (n,), that the analysis started from: an extended pattern may reuse it.")
      .def_prop_ro("bytes", &SupernodalCholesky::bytes, "Memory of L.")
      .def_prop_ro("solve_bytes", &SupernodalCholesky::solve_bytes, "Bytes of L that one solve reads.");
  bind_half_solves(type);
}

}  // namespace

void bind_linalg(nb::module_& m) {
  nb::class_<InverseOperator>(m, "InverseOperator", "x = B^-1 b for a symmetric positive definite B.")
      .def(
          "apply",
          [](InverseOperator& op, const Array<const double>& b, const Array<double>& x) {
            op.apply(sized(b, op.size(), "b"), sized(x, op.size(), "x"));
          },
          nb::arg("b"), nb::arg("x").noconvert(), ReleaseGil());

  nb::class_<Cholesky, InverseOperator>(m, "Cholesky", "Sparse Cholesky factor: analysed once, factorised many times.")
      .def("factorise", &Cholesky::factorise, nb::arg("matrix"), ReleaseGil(),
           "Factorises; returns -1, or the degree of freedom (3 node + axis) whose pivot is not positive.")
      .def_prop_ro("factor_nonzeros", &Cholesky::factor_nonzeros)
      .def_prop_ro("factor_flops", &Cholesky::factor_flops);

#ifdef QLB_HAS_CHOLMOD
  bind_cholmod(m);
#endif

  nb::class_<CarriedInverse, InverseOperator>(m, "CarriedInverse", "An inverse carried along with the material.")
      .def(
          "__init__",
          [](CarriedInverse* self, std::shared_ptr<InverseOperator> inner, std::shared_ptr<TetBlocks> blocks,
             const Array<const std::uint8_t>& fixed,
             int threads) { new (self) CarriedInverse(std::move(inner), std::move(blocks), view(fixed), threads); },
          nb::arg("inner"), nb::arg("blocks"), nb::arg("fixed"), nb::arg("threads"))
      .def(
          "carry",
          [](CarriedInverse& op, const Array<const double>& x, const Array<const double>& reference, double weight) {
            op.carry(sized(x, op.size(), "x"), sized(reference, op.size(), "reference"), weight);
          },
          nb::arg("x"), nb::arg("reference"), nb::arg("weight"), ReleaseGil())
      .def("reset", &CarriedInverse::reset);
  bind_supernodal(m);

  nb::class_<Lbfgs>(m, "Lbfgs", "Limited-memory BFGS around an inner inverse (Nocedal, Wright 2006, algorithm 7.4).")
      .def(nb::init<std::int64_t, int, int>(), nb::arg("size"), nb::arg("window"), nb::arg("threads"))
      .def_prop_ro("pairs", &Lbfgs::pairs)
      .def("clear", &Lbfgs::clear)
      .def(
          "push",
          [](Lbfgs& h, const Array<const double>& x_old, const Array<const double>& x, const Array<const double>& g_old,
             const Array<const double>& g) {
            return h.push(sized(x_old, h.size(), "x_old"), sized(x, h.size(), "x"), sized(g_old, h.size(), "g_old"),
                          sized(g, h.size(), "g"));
          },
          nb::arg("x_old"), nb::arg("x"), nb::arg("g_old"), nb::arg("g"), ReleaseGil())
      .def(
          "direction",
          [](Lbfgs& h, const Array<const double>& g, InverseOperator& inner, const Array<double>& p) {
            if (inner.size() != h.size()) throw std::invalid_argument("the inner inverse has another size");
            return h.direction(sized(g, h.size(), "g"), inner, sized(p, h.size(), "p"));
          },
          nb::arg("g"), nb::arg("inner"), nb::arg("p").noconvert(), ReleaseGil())
      .def(
          "direction_with",
          [](Lbfgs& h, const Array<const double>& g, InverseOperator& inner, const RankOneTerms& terms,
             const Array<double>& p, const std::optional<Array<const double>>& beta,
             const std::optional<Array<const double>>& known) {
            if (inner.size() != h.size()) throw std::invalid_argument("the inner inverse has another size");
            const auto per_term = [&](const std::optional<Array<const double>>& values, const char* name) {
              return values ? std::span<const double>(sized(*values, terms.size(), name), values->size())
                            : std::span<const double>();
            };
            return h.direction_with(sized(g, h.size(), "g"), per_term(beta, "beta"), inner, terms,
                                    sized(p, h.size(), "p"), per_term(known, "known"));
          },
          nb::arg("g"), nb::arg("inner"), nb::arg("terms"), nb::arg("p").noconvert(), nb::arg("beta") = nb::none(),
          nb::arg("known") = nb::none(), ReleaseGil(),
          "As direction, for the gradient g + C beta, with y + C K C^T s in place of y in each pair, for terms C K C^T "
          "that the pairs leave out and `inner` takes in.");

  m.def(
      "dot",
      [](const Array<const double>& a, const Array<const double>& b, int threads) {
        return dot(a.data(), sized(b, a.size(), "b"), a.size(), threads);
      },
      nb::arg("a"), nb::arg("b"), nb::arg("threads"), ReleaseGil());
}

}  // namespace qlb
