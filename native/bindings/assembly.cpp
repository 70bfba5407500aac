#include "bindings/bindings.hpp"

#include "assembly/block_matrix.hpp"

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
          "multiply",
          [](const BlockMatrix& a, const Array<const double>& x, const Array<double>& out) {
            const std::int64_t size = 3 * a.pattern().nodes();
            a.multiply(sized(x, size, "x"), sized(out, size, "out"));
          },
          nb::arg("x"), nb::arg("out").noconvert());
}

}  // namespace qlb
