#pragma once

// Problems over bodies, whole and cut into parts, for tests of what must give the same for both.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "kernels/global/body_parts.hpp"

namespace talus::test {

/// A problem cut by contacts, and what holds its parts together: copies by name of body.
class Cut : public PartLink {
 public:
  /// `part_of` per contact, 0 .. count - 1; every body of the whole stands somewhere.
  Cut(const BodyProblem& whole, const std::vector<std::int32_t>& part_of, std::size_t count)
      : parts(count), bodies_(count), contacts_(count) {
    std::vector<std::vector<std::int32_t>> stands(whole.bodies.size());
    const auto add = [&](std::size_t body, std::int32_t part) {
      auto& in = stands[body];
      if (std::find(in.begin(), in.end(), part) == in.end()) in.push_back(part);
    };
    for (std::size_t k = 0; k < whole.contacts.size(); ++k) {
      add(static_cast<std::size_t>(whole.contacts[k].first), part_of[k]);
      if (whole.contacts[k].second >= 0) add(static_cast<std::size_t>(whole.contacts[k].second), part_of[k]);
      contacts_[static_cast<std::size_t>(part_of[k])].push_back(k);
    }
    for (std::size_t b = 0; b < stands.size(); ++b) {
      if (whole.bodies[b].kind == BodyKind::wall)
        for (std::size_t p = 0; p < count; ++p) add(b, static_cast<std::int32_t>(p));
      if (stands[b].empty()) stands[b] = {0};
      std::sort(stands[b].begin(), stands[b].end());
    }
    for (std::size_t p = 0; p < count; ++p) {
      BodyProblem& part = parts[p];
      part.subdomain = static_cast<std::int32_t>(p);
      std::map<std::int32_t, std::int32_t> unknown;
      for (std::size_t b = 0; b < stands.size(); ++b) {
        const auto& in = stands[b];
        if (std::find(in.begin(), in.end(), part.subdomain) == in.end()) continue;
        const auto own = static_cast<std::int32_t>(part.bodies.size());
        unknown[static_cast<std::int32_t>(b)] = own;
        if (whole.bodies[b].kind != BodyKind::wall) ++part.grains;
        if (in.size() > 1) part.shared.push_back(own);
        part.counts.push_back(in.front() == part.subdomain ? 1 : 0);
        part.bodies.push_back(whole.bodies[b]);
        bodies_[p].push_back(b);
      }
      for (std::size_t k : contacts_[p]) {
        ContactEquation c = whole.contacts[k];
        c.first = unknown.at(c.first);
        if (c.second >= 0) c.second = unknown.at(c.second);
        part.contacts.push_back(c);
        part.impulse.push_back(whole.impulse[k]);
      }
    }
  }

  bool several() const override { return true; }
  void sum_copies(PartField& field) const override {
    std::map<std::size_t, Twist> sum;
    for (std::size_t p = 0; p < field.size(); ++p)
      for (std::size_t b = 0; b < field[p].size(); ++b) {
        sum[bodies_[p][b]].u += field[p][b].u;
        sum[bodies_[p][b]].w += field[p][b].w;
      }
    for (std::size_t p = 0; p < field.size(); ++p)
      for (std::size_t b = 0; b < field[p].size(); ++b) field[p][b] = sum[bodies_[p][b]];
  }
  std::vector<double> gather(std::vector<std::vector<double>> rows) const override {
    std::vector<double> all;
    for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
    return all;
  }

  /// Impulses of the parts, in the order of the whole.
  std::vector<Vec3> impulses(std::size_t count) const {
    std::vector<Vec3> r(count);
    for (std::size_t p = 0; p < parts.size(); ++p)
      for (std::size_t k = 0; k < contacts_[p].size(); ++k) r[contacts_[p][k]] = parts[p].impulse[k];
    return r;
  }
  std::size_t name(std::size_t part, std::size_t body) const { return bodies_[part][body]; }

  std::vector<BodyProblem> parts;

 private:
  std::vector<std::vector<std::size_t>> bodies_, contacts_;
};

/// `across` x `across` columns of `high` touching grains of mass 1, side by side, on a driven floor; with
/// `plate` > 0 under a wall of that mass.
inline BodyProblem block(int across, int high, double mu, double plate) {
  constexpr double radius = 0.01, fall = -0.01;
  BodyProblem problem;
  const auto grain = [&](int x, int y, int z) { return x + across * (y + across * z); };
  const auto touch = [&](const Vec3& n, std::int32_t first, std::int32_t second) {
    problem.contacts.push_back({n, Vec3::Zero(), mu, first, second, -1});
  };
  for (int z = 0; z < high; ++z)
    for (int y = 0; y < across; ++y)
      for (int x = 0; x < across; ++x) {
        BodyUnknown body;
        body.mass = 1;
        body.spin_mass = mu > 0 ? 0.4 : 0;
        body.x = radius * Vec3(2 * x + 1, 2 * y + 1, 2 * z + 1);
        body.radius = radius;
        body.free.u = Vec3(0, 0, fall);
        problem.bodies.push_back(body);
      }
  problem.grains = problem.bodies.size();
  if (plate > 0) {
    BodyUnknown wall;
    wall.mass = plate;
    wall.kind = BodyKind::wall;
    wall.axis = -Vec3::UnitZ();
    wall.free.u = Vec3(0, 0, fall);
    problem.bodies.push_back(wall);
  }
  for (int z = 0; z < high; ++z)
    for (int y = 0; y < across; ++y)
      for (int x = 0; x < across; ++x) {
        touch(Vec3::UnitZ(), grain(x, y, z), z > 0 ? grain(x, y, z - 1) : -1);
        if (x > 0) touch(Vec3::UnitX(), grain(x, y, z), grain(x - 1, y, z));
        if (y > 0) touch(Vec3::UnitY(), grain(x, y, z), grain(x, y - 1, z));
        if (plate > 0 && z + 1 == high)
          touch(-Vec3::UnitZ(), grain(x, y, z), static_cast<std::int32_t>(problem.grains));
      }
  problem.impulse.assign(problem.contacts.size(), Vec3::Zero());
  return problem;
}

}  // namespace talus::test
