#include "bindings/bindings.hpp"

#include "assembly/block_matrix.hpp"
#include "linalg/rank_one_terms.hpp"

namespace qlb {

void bind_assembly(nb::module_& m) {
  nb::class_<BlockPattern>(m, "BlockPattern",
                           "Sparsity of the Hessian: the lower triangle of 3x3 node blocks, by columns.")
      .def(
          "__init__",
          [](BlockPattern* self, std::int64_t nodes, const Array<const std::int32_t>& cliques) {
            new (self) BlockPattern(nodes, view(cliques), cliques.ndim() == 2 ? cliques.shape(1) : 1);
          },
          nb::arg("nodes"), nb::arg("cliques"))
      .def_prop_ro("nodes", &BlockPattern::nodes)
      .def_prop_ro("blocks", &BlockPattern::blocks)
      .def(
          "holds",
          [](const BlockPattern& p, const Array<const std::int32_t>& stencils, const Array<std::uint8_t>& out) {
            if (stencils.size() % 4 != 0) throw std::invalid_argument("stencils must have four entries each");
            p.holds(view(stencils), sized(out, static_cast<std::int64_t>(stencils.size() / 4), "out"));
          },
          nb::arg("stencils"), nb::arg("out").noconvert(), ReleaseGil(),
          "Whether all blocks between the nodes of each stencil, shape (k, 4), are there: 0 or 1, shape (k,).")
      .def_prop_ro(
          "column_begin",
          [](const BlockPattern& p) {
            return nb::ndarray<nb::numpy, const std::int64_t, nb::ndim<1>>(p.column_begin().data(),
                                                                           {p.column_begin().size()});
          },
          nb::rv_policy::reference_internal)
      .def_prop_ro(
          "rows",
          [](const BlockPattern& p) {
            return nb::ndarray<nb::numpy, const std::int32_t, nb::ndim<1>>(p.rows().data(), {p.rows().size()});
          },
          nb::rv_policy::reference_internal);

  nb::class_<PatternMap>(m, "PatternMap", "Where the blocks of a pattern stand in a larger one of the same nodes.")
      .def(
          "__init__",
          [](PatternMap* self, std::shared_ptr<BlockPattern> inner, std::shared_ptr<BlockPattern> outer) {
            new (self) PatternMap(std::move(inner), std::move(outer));
          },
          nb::arg("inner"), nb::arg("outer"));

  nb::class_<BlockMatrix>(m, "BlockMatrix", "Symmetric matrix of 3x3 node blocks over a BlockPattern.")
      .def("__init__",
           [](BlockMatrix* self, std::shared_ptr<BlockPattern> pattern) { new (self) BlockMatrix(std::move(pattern)); })
      .def_prop_ro(
          "values",
          [](BlockMatrix& a) {
            const auto blocks = static_cast<std::size_t>(a.pattern().blocks());
            return nb::ndarray<nb::numpy, double, nb::ndim<3>>(a.values(), {blocks, 3, 3});
          },
          nb::rv_policy::reference_internal)
      .def("set_zero", &BlockMatrix::set_zero, nb::arg("threads"), ReleaseGil())
      .def("shift_diagonal", &BlockMatrix::shift_diagonal, nb::arg("amount"))
      .def(
          "add_stencils",
          [](BlockMatrix& a, const Array<const std::int32_t>& nodes, const Array<const double>& blocks) {
            if (nodes.size() % 4 != 0) throw std::invalid_argument("nodes must have four entries per stencil");
            a.add_stencils(view(nodes), sized(blocks, 36 * static_cast<std::int64_t>(nodes.size()), "blocks"));
          },
          nb::arg("nodes"), nb::arg("blocks"), ReleaseGil(),
          "Adds symmetric matrices, shape (k, 12, 12), between the nodes of stencils, shape (k, 4); repeated nodes add "
          "up.")
      .def(
          "add_rank_one",
          [](BlockMatrix& a, const RankOneTerms& terms, const Array<const std::uint8_t>& left_out) {
            sized(left_out, a.pattern().nodes(), "left_out");
            if (terms.size() == 0) return;
            const auto count = static_cast<std::size_t>(4 * terms.size());
            a.add_rank_one({terms.all_nodes()[0].data(), count}, terms.all_vectors()[0].data(),
                           terms.all_stiffness().data(), view(left_out));
          },
          nb::arg("terms"), nb::arg("left_out"), ReleaseGil(),
          "Adds the sum of the terms; vectors at nodes that are `left_out`, shape (n,), count as zero.")
      .def("set_from", &BlockMatrix::set_from, nb::arg("map"), nb::arg("other"), ReleaseGil(),
           "Takes the values of a matrix over the inner pattern of the map; zero elsewhere.")
      .def(
          "multiply",
          [](const BlockMatrix& a, const Array<const double>& x, const Array<double>& out) {
            const std::int64_t size = 3 * a.pattern().nodes();
            a.multiply(sized(x, size, "x"), sized(out, size, "out"));
          },
          nb::arg("x"), nb::arg("out").noconvert());
}

}  // namespace qlb
