#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>

#include "bindings/bindings.hpp"
#include "bindings/rows.hpp"

#include "linalg/contact_change.hpp"
#include "linalg/rank_one_terms.hpp"
#include "linalg/woodbury_inverse.hpp"

namespace qlb {

void bind_terms(nb::module_& m) {
  constexpr auto inside = nb::rv_policy::reference_internal;
  nb::class_<RankOneTerms>(m, "RankOneTerms",
                           "A sum of matrices stiffness a a^T, a with a vector at each node of a term.")
      .def(
          "__init__",
          [](RankOneTerms* self, const Array<const std::int32_t>& nodes, const Array<const double>& gamma,
             const Array<const double>& axis, const Array<const double>& stiffness) {
            new (self) RankOneTerms(view(nodes), view(gamma), view(axis), view(stiffness));
          },
          nb::arg("nodes"), nb::arg("gamma"), nb::arg("axis"), nb::arg("stiffness"),
          "a = gamma (x) axis: shapes (k, 4), (k, 4), (k, 3), (k,). A node that a term repeats adds up.")
      .def(
          "__init__",
          [](RankOneTerms* self, const Array<const std::int32_t>& nodes, const Array<const double>& vectors,
             const Array<const double>& stiffness) {
            new (self) RankOneTerms(view(nodes), view(vectors), view(stiffness));
          },
          nb::arg("nodes"), nb::arg("vectors"), nb::arg("stiffness"), "Shapes (k, 4), (k, 4, 3), (k,).")
      .def_prop_ro("size", &RankOneTerms::size)
      .def_prop_ro(
          "nodes", [](const RankOneTerms& terms) { return rows(terms.all_nodes()); }, inside)
      .def_prop_ro(
          "vectors",
          [](const RankOneTerms& terms) {
            const auto& v = terms.all_vectors();
            return nb::ndarray<nb::numpy, const double, nb::shape<-1, 4, 3>>(v.empty() ? nullptr : v[0].data(),
                                                                             {v.size(), 4, 3});
          },
          inside)
      .def_prop_ro(
          "stiffness",
          [](const RankOneTerms& terms) {
            const std::vector<double>& k = terms.all_stiffness();
            return nb::ndarray<nb::numpy, const double, nb::ndim<1>>(k.data(), {k.size()});
          },
          inside)
      .def("__len__", &RankOneTerms::size)
      .def(
          "add_combination",
          [](const RankOneTerms& terms, const Array<const double>& beta, const Array<double>& out) {
            terms.check_nodes(static_cast<std::int64_t>(out.size()) / 3);
            terms.add_combination({sized(beta, terms.size(), "beta"), beta.size()}, out.data());
          },
          nb::arg("beta"), nb::arg("out").noconvert(), ReleaseGil(), "out += C beta, shapes (k,) and (n, 3).")
      .def(
          "add_product",
          [](const RankOneTerms& terms, const Array<const double>& v, const Array<double>& out, double scale,
             const std::optional<Array<const double>>& stiffness) {
            terms.check_nodes(static_cast<std::int64_t>(v.size()) / 3);
            const auto size = static_cast<std::int64_t>(v.size());
            const auto count = static_cast<std::size_t>(terms.size());
            const double* k = stiffness ? sized(*stiffness, terms.size(), "stiffness") : terms.all_stiffness().data();
            terms.add_product(v.data(), sized(out, size, "out"), scale, {k, count});
          },
          nb::arg("v"), nb::arg("out").noconvert(), nb::arg("scale") = 1.0, nb::arg("stiffness") = nb::none(),
          ReleaseGil(), "out += scale C K C^T v, both of shape (n, 3); K their own stiffness, or one given (k,).");
}

namespace {

using KeyArray = Array<const std::int64_t>;

void bind_change(nb::module_& m) {
  m.def(
      "contact_change",
      [](const RankOneTerms& now, const KeyArray& keys, const KeyArray& sliding, const RankOneTerms& held,
         const KeyArray& held_keys, const KeyArray& held_sliding, const WoodburyInverse& inverse, double scale,
         double shifted, const std::vector<std::pair<double, double>>& levels, std::int64_t most) {
        std::vector<Nearness> near;
        for (const auto& [small, same] : levels) near.push_back({small, same});
        ContactChange change =
            contact_change({view(keys), view(sliding), now}, {view(held_keys), view(held_sliding), held}, inverse,
                           {scale, shifted, near, most});
        return std::pair(std::make_shared<RankOneTerms>(std::move(change.terms)), change.framed);
      },
      nb::arg("now"), nb::arg("keys"), nb::arg("sliding"), nb::arg("held"), nb::arg("held_keys"),
      nb::arg("held_sliding"), nb::arg("inverse"), nb::arg("scale"), nb::arg("shifted"), nb::arg("levels"),
      nb::arg("most"), ReleaseGil(),
      "What a model needs beside a factor that holds other contacts. now, held: terms, k along normals, 2 f of "
      "friction, any others; keys (k), sliding (f): their pairs of primitives; `held` is in the frame of the factor, "
      "ascending by them. "
      "Gives the terms of now with the stiffness that goes beside the factor, after them others in the frame of the "
      "factor, and how many of these.");
}

std::shared_ptr<SupernodalCholesky> with_half_solves(const std::shared_ptr<InverseOperator>& factor) {
  auto found = std::dynamic_pointer_cast<SupernodalCholesky>(factor);
  if (!found)
    throw std::invalid_argument("WoodburyInverse works between half-solves, which only SupernodalCholesky has");
  return found;
}

}  // namespace

void bind_low_rank(nb::module_& m) {
  nb::class_<WoodburyInverse, InverseOperator>(
      m, "WoodburyInverse", "An inverse carried along with the material, with rank-one terms added to the matrix.")
      .def(
          "__init__",
          [](WoodburyInverse* self, const std::shared_ptr<InverseOperator>& factor, std::shared_ptr<TetBlocks> blocks,
             const Array<const std::uint8_t>& fixed, int threads) {
            new (self) WoodburyInverse(with_half_solves(factor), std::move(blocks), view(fixed), threads);
          },
          nb::arg("factor"), nb::arg("blocks"), nb::arg("fixed"), nb::arg("threads"))
      .def(
          "carry",
          [](WoodburyInverse& op, const Array<const double>& x, const Array<const double>& reference, double weight) {
            op.carry(sized(x, op.size(), "x"), sized(reference, op.size(), "reference"), weight);
          },
          nb::arg("x"), nb::arg("reference"), nb::arg("weight"), ReleaseGil(),
          "Maps from how the material has moved since the factor was made at `reference`; the terms stay.")
      .def("reset", &WoodburyInverse::reset, ReleaseGil(), "Maps of one; the terms stay.")
      .def(
          "set_terms",
          [](WoodburyInverse& op, std::shared_ptr<RankOneTerms> terms, std::int64_t framed) {
            return op.set_terms(std::move(terms), framed);
          },
          nb::arg("terms"), nb::arg("framed") = 0, ReleaseGil(),
          "Replaces the terms; the last `framed` of them are in the frame of the factor as they are. False where the "
          "sum is not positive definite: it then goes on without any.")
      .def(
          "pull_back",
          [](const WoodburyInverse& op, const Array<const std::int32_t>& nodes, const Array<const double>& vectors,
             const Array<double>& out) {
            const auto size = static_cast<std::int64_t>(3 * nodes.size());
            sized(vectors, size, "vectors");
            op.pull_back(view(nodes), view(vectors), sized(out, size, "out"));
          },
          nb::arg("nodes"), nb::arg("vectors"), nb::arg("out").noconvert(), ReleaseGil(),
          "out = vectors at their nodes in the frame of the factor; shapes (k, 4, 3), nodes (k, 4).")
      .def("forget", &WoodburyInverse::forget,
           "Drops the terms and the half-solves kept: for when the factor is made anew.")
      .def_prop_ro("terms", &WoodburyInverse::terms)
      .def_prop_ro("active_terms", &WoodburyInverse::active_terms, "Terms with a node that is free.")
      .def_prop_ro("columns", &WoodburyInverse::columns, "Nodes whose half-solves are kept.")
      .def_prop_ro("bytes", &WoodburyInverse::bytes, "Memory of the half-solves and their products.");
  bind_change(m);
}

}  // namespace qlb
