#include "kernels/global/coarse_level.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

/// Grains that a part makes aggregates of.
bool grain_here(const BodyProblem& problem, std::int32_t body) {
  return body >= 0 && at(body) < problem.grains && problem.counted(at(body));
}

/// Neighbours of every grain, in order of contact: begin (one more than grains) and the list.
struct Adjacency {
  std::vector<std::size_t> begin;
  std::vector<std::int32_t> other;
};

Adjacency grain_neighbours(const BodyProblem& problem) {
  Adjacency graph;
  graph.begin.assign(problem.grains + 1, 0);
  const auto between_grains = [&](const ContactEquation& c) {
    return grain_here(problem, c.first) && grain_here(problem, c.second);
  };
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

/// The largest of a count that each part has.
std::size_t longest(const BodyParts& parts, const std::function<std::size_t(std::size_t)>& count) {
  const std::vector<double> counts =
      parts.rows(1, [&](std::size_t p, std::span<double> row) { row[0] = static_cast<double>(count(p)); });
  return static_cast<std::size_t>(*std::max_element(counts.begin(), counts.end()));
}

}  // namespace

int aggregate_target(std::size_t bodies) {
  constexpr std::size_t most_aggregates = 2048;
  return static_cast<int>(std::max(std::clamp<std::size_t>(bodies / 125, 16, 256), bodies / most_aggregates));
}

Aggregates grow_aggregates(const BodyProblem& problem, std::span<const char> touched, int target) {
  const Adjacency graph = grain_neighbours(problem);
  // Passes over the blocks solve a grain that touches driven walls only: it needs no aggregate.
  std::vector<char> tied(problem.bodies.size(), 0);
  for (const ContactEquation& c : problem.contacts)
    if (c.second >= 0) tied[at(c.first)] = tied[at(c.second)] = 1;
  for (const std::int32_t b : problem.shared) tied[at(b)] = 1;
  Aggregates result;
  result.of_body.assign(problem.bodies.size(), -1);
  std::vector<std::int32_t> members;
  for (std::size_t seed = 0; seed < problem.grains; ++seed) {
    if (!touched[seed] || !tied[seed] || !problem.counted(seed) || result.of_body[seed] >= 0) continue;
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
    // A small group left over between full aggregates joins the first one it touches.
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

CoarseLevel::CoarseLevel(const BodyParts& parts, std::span<const std::vector<char>> touched,
                         std::span<const std::vector<double>> rho, int target)
    : parts_(parts), members_(parts.size()), groups_(parts.size()) {
  join(touched, target);
  list_groups();
  size_ = first(aggregates_ + walls_);
  if (size_ > 0) factorise(rho);
}

/// Aggregates grow within the parts and are numbered through all of them. Each body that counts passes on to
/// its copies how it moves with its aggregate.
void CoarseLevel::join(std::span<const std::vector<char>> touched, int target) {
  std::vector<Aggregates> own(parts_.size());
  const std::vector<double> counts = parts_.rows(1, [&](std::size_t p, std::span<double> row) {
    own[p] = grow_aggregates(parts_[p], touched[p], target);
    row[0] = own[p].count;
  });
  std::vector<std::int64_t> begin(counts.size() + 1, 0);
  for (std::size_t k = 0; k < counts.size(); ++k)
    begin[k + 1] = begin[k] + static_cast<std::int64_t>(counts[k]);
  aggregates_ = begin.back();
  walls_ = static_cast<std::int64_t>(parts_[0].walls());

  PartField arm = parts_.field(), name = parts_.field();
  parts_.each([&](std::size_t p) {
    const BodyProblem& problem = parts_[p];
    const auto count = at(own[p].count);
    std::vector<Vec3> centre(count, Vec3::Zero());
    std::vector<double> length2(count, 0), members(count, 0);
    for (std::size_t b = 0; b < problem.grains; ++b)
      if (const std::int32_t a = own[p].of_body[b]; a >= 0) {
        centre[at(a)] += problem.bodies[b].x;
        members[at(a)] += 1;
      }
    for (std::size_t a = 0; a < count; ++a) centre[a] /= members[a];
    for (std::size_t b = 0; b < problem.grains; ++b)
      if (const std::int32_t a = own[p].of_body[b]; a >= 0) {
        const BodyUnknown& body = problem.bodies[b];
        arm[p][b].u = body.x - centre[at(a)];
        length2[at(a)] += (arm[p][b].u.squaredNorm() + body.radius * body.radius) / members[at(a)];
      }
    const auto first = static_cast<double>(begin[at(problem.subdomain)]);
    for (std::size_t b = 0; b < problem.grains; ++b)
      if (const std::int32_t a = own[p].of_body[b]; a >= 0)
        name[p][b].u = Vec3(first + a + 1, std::sqrt(length2[at(a)]), 0);
  });
  parts_.link().sum_copies(arm);
  parts_.link().sum_copies(name);
  parts_.each([&](std::size_t p) {
    members_[p].resize(parts_[p].bodies.size());
    for (std::size_t b = 0; b < parts_[p].grains; ++b)
      members_[p][b] = {static_cast<std::int32_t>(name[p][b].u[0]) - 1, -1, arm[p][b].u, name[p][b].u[1]};
  });
}

/// Which aggregates a part adds to: those of its bodies.
void CoarseLevel::list_groups() {
  parts_.each([&](std::size_t p) {
    std::vector<std::int32_t>& groups = groups_[p];
    for (const Member& member : members_[p])
      if (member.group >= 0) groups.push_back(member.group);
    std::sort(groups.begin(), groups.end());
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    for (Member& member : members_[p])
      if (member.group >= 0)
        member.local = static_cast<std::int32_t>(
            std::lower_bound(groups.begin(), groups.end(), member.group) - groups.begin());
  });
  most_ = longest(parts_, [&](std::size_t p) { return groups_[p].size(); });
  groups_of_all_ = parts_.rows(most_, [&](std::size_t p, std::span<double> row) {
    std::fill(row.begin(), row.end(), -1.0);
    std::copy(groups_[p].begin(), groups_[p].end(), row.begin());
  });
}

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The matrix of Omega -> Omega x r.
Eigen::Matrix3d rotation(const Vec3& r) {
  Eigen::Matrix3d m;
  m << 0, r[2], -r[1], -r[2], 0, r[0], r[1], -r[0], 0;
  return m;
}

}  // namespace

/// A block of the lower triangle: its rows are those of the higher group. A wall has one row.
struct CoarseLevel::Block {
  std::int64_t high, low;
  Matrix6 values = Matrix6::Zero();
};

/// The blocks of one part, found by the pair of groups that they couple.
class CoarseLevel::BlockMap {
 public:
  /// All blocks that the contacts and bodies of part p of `level` add to, each 0 yet.
  BlockMap(const CoarseLevel& level, std::size_t p) : level_(level), p_(p) {
    const BodyProblem& problem = level.parts_[p];
    for (const ContactEquation& c : problem.contacts) {
      const std::int64_t one = group_of(c.first), other = c.second < 0 ? one : group_of(c.second);
      keys_.insert(keys_.end(),
                   {key(one, one), key(other, other), key(std::max(one, other), std::min(one, other))});
    }
    for (std::size_t b = 0; b < problem.grains + problem.walls(); ++b)
      if (const std::int64_t g = group_of(static_cast<std::int32_t>(b)); problem.counted(b) && g >= 0)
        keys_.push_back(key(g, g));
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    for (std::int64_t k : keys_) blocks_.push_back({k / groups(), k % groups()});
  }

  std::int64_t group_of(std::int32_t body) const {
    const BodyProblem& problem = level_.parts_[p_];
    return at(body) < problem.grains
               ? std::int64_t{level_.members_[p_][at(body)].group}
               : level_.aggregates_ + static_cast<std::int64_t>(at(body) - problem.grains);
  }
  Matrix6& operator()(std::int64_t high, std::int64_t low) {
    const auto place = std::lower_bound(keys_.begin(), keys_.end(), key(high, low)) - keys_.begin();
    return blocks_[static_cast<std::size_t>(place)].values;
  }
  std::vector<Block> take() { return std::move(blocks_); }

 private:
  std::int64_t groups() const { return level_.aggregates_ + level_.walls_; }
  std::int64_t key(std::int64_t high, std::int64_t low) const { return high * groups() + low; }

  const CoarseLevel& level_;
  std::size_t p_;
  std::vector<std::int64_t> keys_;  ///< ascending
  std::vector<Block> blocks_;       ///< per key
};

/// What the motion of the group of a contact's first or second body adds to the relative velocity.
CoarseLevel::ContactMotion CoarseLevel::contact_motion(std::size_t p, const ContactEquation& c,
                                                       bool is_first) const {
  const std::int32_t index = is_first ? c.first : c.second;
  const double sign = is_first ? 1 : -1;
  const BodyUnknown& body = parts_[p].bodies[at(index)];
  ContactMotion motion = ContactMotion::Zero();
  if (body.kind == BodyKind::wall) {
    motion.col(0) = sign * body.axis;
    return motion;
  }
  const Member& member = members_[p][at(index)];
  motion.leftCols<3>() = sign * Eigen::Matrix3d::Identity();
  motion.rightCols<3>() = sign * rotation(member.arm);
  if (body.spin_mass > 0 && c.levers != nullptr)
    motion.rightCols<3>() += sign * body.radius * (is_first ? c.levers->first : c.levers->second);
  else if (body.spin_mass > 0)
    motion.rightCols<3>() -= body.radius * rotation(c.normal);  // n x (R Omega)
  motion.rightCols<3>() /= member.length;
  return motion;
}

/// What a part adds to P^T A P, by ascending (high, low).
std::vector<CoarseLevel::Block> CoarseLevel::blocks_of(std::size_t p, std::span<const double> rho) const {
  const BodyProblem& problem = parts_[p];
  BlockMap block(*this, p);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Eigen::Matrix3d weight = c.mu > 0 ? Eigen::Matrix3d(rho[k] * Eigen::Matrix3d::Identity())
                                            : Eigen::Matrix3d(rho[k] * c.normal * c.normal.transpose());
    const std::int64_t one = block.group_of(c.first), other = c.second < 0 ? one : block.group_of(c.second);
    ContactMotion a = contact_motion(p, c, true);
    if (c.second >= 0) {
      const ContactMotion b = contact_motion(p, c, false);
      if (one == other) {
        a += b;
      } else {
        block(other, other) += b.transpose() * weight * b;
        if (one > other)
          block(one, other) += a.transpose() * weight * b;
        else
          block(other, one) += b.transpose() * weight * a;
      }
    }
    block(one, one) += a.transpose() * weight * a;
  }

  // A cell is none of the coarse unknowns.
  for (std::size_t b = 0; b < problem.grains + problem.walls(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    const std::int64_t g = block.group_of(static_cast<std::int32_t>(b));
    if (!problem.counted(b) || g < 0) continue;
    if (body.kind == BodyKind::wall) {
      block(g, g)(0, 0) += body.mass;
      continue;
    }
    const Member& member = members_[p][b];
    const double relative = body.radius / member.length;
    ContactMotion motion;
    motion << Eigen::Matrix3d::Identity(), rotation(member.arm) / member.length;
    Matrix6 mass = body.mass * motion.transpose() * motion;
    // A little inertia is added also to bodies that do not rotate: the rotation of a row of grains about its
    // axis would have none.
    mass.diagonal().tail<3>().array() += std::max(body.spin_mass * relative * relative, 1e-6 * body.mass);
    block(g, g) += mass;
  }
  return block.take();
}

/// Blocks of all parts, added in order of subdomain.
void CoarseLevel::factorise(std::span<const std::vector<double>> rho) {
  constexpr std::size_t numbers = 2 + 36;
  std::vector<std::vector<Block>> blocks(parts_.size());
  parts_.each([&](std::size_t p) { blocks[p] = blocks_of(p, rho[p]); });
  const std::size_t most = longest(parts_, [&](std::size_t p) { return blocks[p].size(); });
  const std::vector<double> all = parts_.rows(numbers * most, [&](std::size_t p, std::span<double> row) {
    std::fill(row.begin(), row.end(), -1.0);
    double* out = row.data();
    for (const Block& block : blocks[p]) {
      *out++ = static_cast<double>(block.high);
      *out++ = static_cast<double>(block.low);
      out = std::copy_n(block.values.data(), 36, out);
    }
  });
  const auto width = [&](std::int64_t group) { return Eigen::Index{group < aggregates_ ? 6 : 1}; };
  // Entries that come twice are added in the order in which they come.
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < all.size(); k += numbers) {
    if (all[k] < 0) continue;
    const auto high = static_cast<std::int64_t>(all[k]), low = static_cast<std::int64_t>(all[k + 1]);
    const Eigen::Map<const Matrix6> values(&all[k + 2]);
    for (Eigen::Index i = 0; i < width(high); ++i)
      for (Eigen::Index j = 0; j < width(low); ++j)
        entries.emplace_back(first(high) + i, first(low) + j, values(i, j));
  }
  Eigen::SparseMatrix<double> matrix(size_, size_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  solver_.compute(matrix);
}

void CoarseLevel::correct(const PartField& f, PartField& x) const {
  if (size_ == 0 || solver_.info() != Eigen::Success) return;
  const auto walls = static_cast<std::size_t>(walls_);
  const std::size_t width = 6 * most_ + walls;
  const std::vector<double> rows = parts_.rows(width, [&](std::size_t p, std::span<double> row) {
    const BodyProblem& problem = parts_[p];
    for (std::size_t b = 0; b < problem.grains; ++b) {
      const Member& member = members_[p][b];
      if (member.group < 0) continue;
      Eigen::Map<Eigen::Matrix<double, 6, 1>> force(&row[6 * at(member.local)]);
      force.head<3>() += f[p][b].u;
      force.tail<3>() += (member.arm.cross(f[p][b].u) + problem.bodies[b].radius * f[p][b].w) / member.length;
    }
    for (std::size_t w = 0; w < walls; ++w)
      row[6 * most_ + w] = problem.bodies[problem.grains + w].axis.dot(f[p][problem.grains + w].u);
  });
  Eigen::VectorXd force = Eigen::VectorXd::Zero(size_);
  for (std::size_t part = 0; part * width < rows.size(); ++part) {
    const double* const row = &rows[part * width];
    const double* const groups = groups_of_all_.data() + part * most_;
    for (std::size_t k = 0; k < most_ && groups[k] >= 0; ++k)
      force.segment<6>(first(static_cast<std::int64_t>(groups[k]))) +=
          Eigen::Map<const Eigen::Matrix<double, 6, 1>>(row + 6 * k);
    for (std::size_t w = 0; w < walls; ++w)
      force[first(aggregates_ + static_cast<std::int64_t>(w))] += row[6 * most_ + w];
  }
  const Eigen::VectorXd motion = solver_.solve(force);
  parts_.each([&](std::size_t p) {
    const BodyProblem& problem = parts_[p];
    for (std::size_t b = 0; b < problem.grains; ++b) {
      const Member& member = members_[p][b];
      if (member.group < 0) continue;
      const Eigen::Index begin = first(member.group);
      const Vec3 turn = motion.segment<3>(begin + 3) / member.length;
      x[p][b].u += motion.segment<3>(begin) + turn.cross(member.arm);
      if (problem.bodies[b].spin_mass > 0) x[p][b].w += problem.bodies[b].radius * turn;
    }
    for (std::size_t w = 0; w < walls; ++w)
      x[p][problem.grains + w].u +=
          motion[first(aggregates_ + static_cast<std::int64_t>(w))] * problem.bodies[problem.grains + w].axis;
  });
}

}  // namespace talus
