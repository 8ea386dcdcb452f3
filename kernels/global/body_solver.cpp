#include "kernels/global/body_solver.hpp"

namespace talus {

namespace {

/// The systems of the parts. Blocks on the diagonal are those of all contacts of a body, wherever they are.
std::vector<BodySystem> systems_of(const BodyParts& parts, std::span<const std::vector<double>> rho) {
  std::vector<BodySystem> systems;
  systems.reserve(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) systems.emplace_back(parts[p], rho[p]);
  PartField column = parts.field();
  for (Eigen::Index k = 0; k < 6; ++k) {
    parts.each([&](std::size_t p) {
      for (std::size_t b = 0; b < column[p].size(); ++b) {
        const auto& block = systems[p].diagonal()[b];
        column[p][b] = {block.col(k).head<3>(), block.col(k).tail<3>()};
      }
    });
    parts.link().sum_copies(column);
    parts.each([&](std::size_t p) {
      for (std::size_t b = 0; b < column[p].size(); ++b)
        systems[p].diagonal()[b].col(k) << column[p][b].u, column[p][b].w;
    });
  }
  parts.each([&](std::size_t p) { systems[p].close(); });
  return systems;
}

std::vector<std::vector<char>> touched_bodies(std::span<const BodySystem> systems) {
  std::vector<std::vector<char>> touched;
  for (const BodySystem& system : systems) touched.push_back(system.touched());
  return touched;
}

/// Grains per aggregate: as asked for, or chosen from the number of grains.
int target_of(const BodyParts& parts, int asked) {
  if (asked > 0) return asked;
  const double grains = parts.total(1, [&](std::size_t p, std::span<double> row) {
    for (std::size_t b = 0; b < parts[p].grains; ++b) row[0] += parts[p].counted(b) ? 1 : 0;
  })[0];
  return aggregate_target(static_cast<std::size_t>(grains));
}

/// a += factor b.
void add(std::vector<Twist>& a, double factor, const std::vector<Twist>& b) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    a[k].u += factor * b[k].u;
    a[k].w += factor * b[k].w;
  }
}

}  // namespace

BodySolver::BodySolver(const BodyParts& parts, std::span<const std::vector<double>> rho, int aggregate)
    : parts_(parts),
      systems_(systems_of(parts, rho)),
      coarse_(parts, touched_bodies(systems_), rho, target_of(parts, aggregate)),
      residual_(parts.field()),
      z_(residual_),
      direction_(residual_),
      product_(residual_),
      rest_(residual_) {}

void BodySolver::multiply(const PartField& x, PartField& y) const {
  parts_.each([&](std::size_t p) { systems_[p].multiply(x[p], y[p]); });
  parts_.link().sum_copies(y);
}

/// z = B r with B symmetric: the second half of the smoother is the transpose of the first.
void BodySolver::precondition() {
  parts_.each([&](std::size_t p) { systems_[p].smooth_forward(residual_[p], z_[p]); });
  parts_.link().sum_copies(z_);
  parts_.each([&](std::size_t p) { systems_[p].rest_of_forward(z_[p], rest_[p]); });
  coarse_.correct(rest_, z_);
  parts_.each([&](std::size_t p) { systems_[p].take_ties(residual_[p], z_[p], rest_[p]); });
  parts_.link().sum_copies(rest_);
  parts_.each([&](std::size_t p) { systems_[p].smooth_backward(rest_[p], z_[p]); });
  parts_.link().sum_copies(z_);
}

double BodySolver::begin(const PartField& f, const PartField& V) {
  multiply(V, product_);
  parts_.each([&](std::size_t p) {
    residual_[p] = f[p];
    add(residual_[p], -1, product_[p]);
  });
  precondition();
  direction_ = z_;
  return left_ = parts_.dot(residual_, z_);
}

double BodySolver::iterate(PartField& V) {
  multiply(direction_, product_);
  const double curvature = parts_.dot(direction_, product_);
  if (!(curvature > 0)) return 0;
  const double step = left_ / curvature;
  parts_.each([&](std::size_t p) {
    add(V[p], step, direction_[p]);
    add(residual_[p], -step, product_[p]);
  });
  precondition();
  const double next = parts_.dot(residual_, z_);
  const double beta = next / left_;
  left_ = next;
  parts_.each([&](std::size_t p) {
    for (std::size_t b = 0; b < z_[p].size(); ++b) {
      direction_[p][b].u = z_[p][b].u + beta * direction_[p][b].u;
      direction_[p][b].w = z_[p][b].w + beta * direction_[p][b].w;
    }
  });
  return next;
}

int BodySolver::solve(const PartField& f, PartField& V, double tolerance, int max_iterations) {
  double left = begin(f, V);
  const double goal = tolerance * tolerance * left;
  int k = 0;
  for (; k < max_iterations && left > goal; ++k) left = iterate(V);
  return k;
}

}  // namespace talus
