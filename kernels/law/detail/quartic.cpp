#include "kernels/law/detail/quartic.hpp"

#include <Eigen/Eigenvalues>

namespace talus::detail {

std::optional<std::array<double, 4>> real_parts_of_roots(const std::array<double, 4>& a) {
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.bottomLeftCorner<3, 3>().setIdentity();
  companion.col(3) << -a[0], -a[1], -a[2], -a[3];
  if (!companion.allFinite()) return std::nullopt;
  const Eigen::EigenSolver<Eigen::Matrix4d> solver(companion, false);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const auto& root = solver.eigenvalues();
  return std::array{root[0].real(), root[1].real(), root[2].real(), root[3].real()};
}

}  // namespace talus::detail
