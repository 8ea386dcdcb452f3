#include "kernels/coarse_level.hpp"

#include <algorithm>
#include <cmath>

namespace talus {

namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

/// Neighbours of every grain, in order of contact: begin (one more than grains) and the list.
struct Adjacency {
  std::vector<std::size_t> begin;
  std::vector<std::int32_t> other;
};

Adjacency grain_neighbours(const BodyProblem& problem) {
  Adjacency graph;
  const auto grains = static_cast<std::int32_t>(problem.grains);
  graph.begin.assign(problem.grains + 1, 0);
  const auto between_grains = [&](const ContactEquation& c) { return c.second >= 0 && c.second < grains; };
  for (const ContactEquation& c : problem.contacts)
    if (between_grains(c)) {
      ++graph.begin[at(c.first) + 1];
      ++graph.begin[at(c.second) + 1];
    }
  for (std::size_t b = 0; b < problem.grains; ++b) graph.begin[b + 1] += graph.begin[b];
  graph.other.resize(graph.begin.back());
  std::vector<std::size_t> next(graph.begin.begin(), graph.begin.end() - 1);
  for (const ContactEquation& c : problem.contacts)
    if (between_grains(c)) {
      graph.other[next[at(c.first)]++] = c.second;
      graph.other[next[at(c.second)]++] = c.first;
    }
  return graph;
}

}  // namespace

int aggregate_target(std::size_t bodies) {
  return static_cast<int>(std::clamp<std::size_t>(bodies / 125, 16, 256));
}

Aggregates grow_aggregates(const BodyProblem& problem, int target) {
  const Adjacency graph = grain_neighbours(problem);
  Aggregates result;
  result.of_body.assign(problem.bodies.size(), -1);
  std::vector<char> touched(problem.grains, 0);
  for (const ContactEquation& c : problem.contacts) {
    touched[at(c.first)] = 1;
    if (c.second >= 0 && at(c.second) < problem.grains) touched[at(c.second)] = 1;
  }
  std::vector<int> size;
  std::vector<std::int32_t> members;
  for (std::size_t seed = 0; seed < problem.grains; ++seed) {
    if (!touched[seed] || result.of_body[seed] >= 0) continue;
    const std::int32_t own = result.count;
    members.assign(1, static_cast<std::int32_t>(seed));
    result.of_body[seed] = own;
    for (std::size_t head = 0; head < members.size(); ++head) {
      const std::size_t b = at(members[head]);
      for (std::size_t e = graph.begin[b]; e < graph.begin[b + 1]; ++e) {
        const std::int32_t other = graph.other[e];
        if (static_cast<int>(members.size()) >= target) break;
        if (result.of_body[at(other)] >= 0) continue;
        result.of_body[at(other)] = own;
        members.push_back(other);
      }
    }
    // A scrap between full aggregates joins the one it touches first.
    if (static_cast<int>(members.size()) * 4 < target) {
      std::int32_t host = -1;
      for (std::size_t m = 0; m < members.size() && host < 0; ++m)
        for (std::size_t e = graph.begin[at(members[m])]; e < graph.begin[at(members[m]) + 1] && host < 0;
             ++e)
          if (result.of_body[at(graph.other[e])] != own) host = result.of_body[at(graph.other[e])];
      if (host >= 0) {
        for (std::int32_t m : members) result.of_body[at(m)] = host;
        continue;
      }
    }
    ++result.count;
  }
  return result;
}

CoarseLevel::CoarseLevel(const BodyProblem& problem, const Aggregates& aggregates,
                         std::span<const double> rho)
    : problem_(problem), aggregates_(aggregates) {
  const auto count = static_cast<std::size_t>(aggregates.count);
  centre_.assign(count, Vec3::Zero());
  length_.assign(count, 0);
  std::vector<double> members(count, 0);
  for (std::size_t b = 0; b < problem.grains; ++b)
    if (const std::int32_t a = aggregates.of_body[b]; a >= 0) {
      centre_[at(a)] += problem.bodies[b].x;
      members[at(a)] += 1;
    }
  for (std::size_t a = 0; a < count; ++a) centre_[a] /= members[a];
  for (std::size_t b = 0; b < problem.grains; ++b)
    if (const std::int32_t a = aggregates.of_body[b]; a >= 0)
      length_[at(a)] += ((problem.bodies[b].x - centre_[at(a)]).squaredNorm() +
                         problem.bodies[b].radius * problem.bodies[b].radius) /
                        members[at(a)];
  for (double& length : length_) length = std::sqrt(length);

  assemble(rho);
  if (size() > 0) {
    solver_.analyzePattern(Matrix(mass_ + stiffness_));
    factorise();
  }
}

namespace {

using Block = Eigen::Matrix<double, 6, 6>;

/// The matrix of Omega -> Omega x r.
Eigen::Matrix3d rotation(const Vec3& r) {
  Eigen::Matrix3d m;
  m << 0, r[2], -r[1], -r[2], 0, r[0], r[1], -r[0], 0;
  return m;
}

/// Symmetric matrix of blocks: on the diagonal, and of pairs (key = higher x count + lower, sorted).
struct Blocks {
  std::vector<Block> diagonal;
  std::vector<std::size_t> key;
  std::vector<Block> pair;  ///< rows of the higher group
};

}  // namespace

/// A group is an aggregate, 6 coarse unknowns, or a wall, 1.
void CoarseLevel::assemble(std::span<const double> rho) {
  const auto aggregates = at(aggregates_.count);
  const std::size_t groups = aggregates + problem_.bodies.size() - problem_.grains;
  const auto first = [&](std::size_t group) {
    return static_cast<Eigen::Index>(group < aggregates ? 6 * group : 5 * aggregates + group);
  };
  const auto width = [&](std::size_t group) { return Eigen::Index{group < aggregates ? 6 : 1}; };
  const auto group_of = [&](std::int32_t body) {
    return problem_.bodies[at(body)].wall ? aggregates + at(body) - problem_.grains
                                          : at(aggregates_.of_body[at(body)]);
  };
  /// Relative velocity at a contact as a function of the motion of a body's group.
  using Part = Eigen::Matrix<double, 3, 6>;
  const auto part_of = [&](std::int32_t index, double sign, const Vec3& n) {
    const BodyUnknown& body = problem_.bodies[at(index)];
    Part part = Part::Zero();
    if (body.wall) {
      part.col(0) = sign * body.axis;
      return part;
    }
    part.leftCols<3>() = sign * Eigen::Matrix3d::Identity();
    part.rightCols<3>() = sign * rotation(arm(at(index)));
    if (body.spin_mass > 0) part.rightCols<3>() -= body.radius * rotation(n);  // n x (R Omega)
    part.rightCols<3>() /= length_[at(aggregates_.of_body[at(index)])];
    return part;
  };

  Blocks blocks;
  for (const ContactEquation& c : problem_.contacts) {
    if (c.second < 0) continue;
    const std::size_t p = group_of(c.first), q = group_of(c.second);
    if (p != q) blocks.key.push_back(std::max(p, q) * groups + std::min(p, q));
  }
  std::sort(blocks.key.begin(), blocks.key.end());
  blocks.key.erase(std::unique(blocks.key.begin(), blocks.key.end()), blocks.key.end());
  blocks.pair.assign(blocks.key.size(), Block::Zero());
  blocks.diagonal.assign(groups, Block::Zero());
  for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
    const ContactEquation& c = problem_.contacts[k];
    const Eigen::Matrix3d weight = c.mu > 0 ? Eigen::Matrix3d(rho[k] * Eigen::Matrix3d::Identity())
                                            : Eigen::Matrix3d(rho[k] * c.normal * c.normal.transpose());
    const std::size_t p = group_of(c.first), q = c.second < 0 ? p : group_of(c.second);
    Part a = part_of(c.first, 1, c.normal);
    if (c.second >= 0) {
      const Part b = part_of(c.second, -1, c.normal);
      if (p == q) {
        a += b;
      } else {
        blocks.diagonal[q] += b.transpose() * weight * b;
        const auto place =
            std::lower_bound(blocks.key.begin(), blocks.key.end(), std::max(p, q) * groups + std::min(p, q)) -
            blocks.key.begin();
        Block& pair = blocks.pair[static_cast<std::size_t>(place)];
        if (p > q)
          pair += a.transpose() * weight * b;
        else
          pair += b.transpose() * weight * a;
      }
    }
    blocks.diagonal[p] += a.transpose() * weight * a;
  }

  // The lower triangle is all that the factorisation reads.
  const auto size = first(groups);
  std::vector<Eigen::Triplet<double>> entries;
  const auto write = [&](std::size_t p, std::size_t q, const Block& block) {
    for (Eigen::Index i = 0; i < width(p); ++i)
      for (Eigen::Index j = 0; j < width(q); ++j)
        entries.emplace_back(first(p) + i, first(q) + j, block(i, j));
  };
  for (std::size_t g = 0; g < groups; ++g) write(g, g, blocks.diagonal[g]);
  for (std::size_t k = 0; k < blocks.key.size(); ++k)
    write(blocks.key[k] / groups, blocks.key[k] % groups, blocks.pair[k]);
  stiffness_.resize(size, size);
  stiffness_.setFromTriplets(entries.begin(), entries.end());

  blocks.diagonal.assign(groups, Block::Zero());
  for (std::size_t b = 0; b < problem_.bodies.size(); ++b) {
    const BodyUnknown& body = problem_.bodies[b];
    if (body.wall) {
      blocks.diagonal[aggregates + b - problem_.grains](0, 0) = body.mass;
      continue;
    }
    const std::int32_t a = aggregates_.of_body[b];
    if (a < 0) continue;
    const double length = length_[at(a)], relative = body.radius / length;
    Part part;
    part << Eigen::Matrix3d::Identity(), rotation(arm(b)) / length;
    Block& block = blocks.diagonal[at(a)];
    block += body.mass * part.transpose() * part;
    // A little inertia also where nothing turns: grains in a row would leave a rotation without any.
    block.diagonal().tail<3>().array() += std::max(body.spin_mass * relative * relative, 1e-6 * body.mass);
  }
  entries.clear();
  for (std::size_t g = 0; g < groups; ++g) write(g, g, blocks.diagonal[g]);
  mass_.resize(size, size);
  mass_.setFromTriplets(entries.begin(), entries.end());
}

Vec3 CoarseLevel::arm(std::size_t body) const {
  return problem_.bodies[body].x - centre_[at(aggregates_.of_body[body])];
}

void CoarseLevel::factorise() {
  solver_.factorize(Matrix(mass_ + factor_ * stiffness_));
}

void CoarseLevel::scale(double factor) {
  factor_ *= factor;
  if (size() > 0) factorise();
}

void CoarseLevel::correct(std::span<const Twist> f, std::span<Twist> x) const {
  if (size() == 0 || solver_.info() != Eigen::Success) return;
  Eigen::VectorXd force = Eigen::VectorXd::Zero(size());
  for (std::size_t b = 0; b < f.size(); ++b) {
    const BodyUnknown& body = problem_.bodies[b];
    if (body.wall) {
      force[wall_unknown(b)] += body.axis.dot(f[b].u);
      continue;
    }
    const std::int32_t a = aggregates_.of_body[b];
    if (a < 0) continue;
    force.segment<3>(6 * a) += f[b].u;
    force.segment<3>(6 * a + 3) += (arm(b).cross(f[b].u) + body.radius * f[b].w) / length_[at(a)];
  }
  const Eigen::VectorXd motion = solver_.solve(force);
  for (std::size_t b = 0; b < f.size(); ++b) {
    const BodyUnknown& body = problem_.bodies[b];
    if (body.wall) {
      x[b].u += motion[wall_unknown(b)] * body.axis;
      continue;
    }
    const std::int32_t a = aggregates_.of_body[b];
    if (a < 0) continue;
    const Vec3 turn = motion.segment<3>(6 * a + 3) / length_[at(a)];
    x[b].u += motion.segment<3>(6 * a) + turn.cross(arm(b));
    if (body.spin_mass > 0) x[b].w += body.radius * turn;
  }
}

}  // namespace talus
