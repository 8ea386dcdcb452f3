#include "kernels/global/body_parts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "kernels/global/admm.hpp"
#include "kernels/global/body_solver.hpp"

namespace talus {
namespace {

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
      if (whole.bodies[b].wall)
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
        if (!whole.bodies[b].wall) ++part.grains;
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
BodyProblem block(int across, int high, double mu, double plate) {
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
    wall.wall = true;
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

/// Contacts dealt to `count` parts by height, and a few at random, so that grains stand in up to four.
std::vector<std::int32_t> by_height(const BodyProblem& problem, std::size_t count) {
  std::vector<std::int32_t> part;
  std::uint32_t draw = 1;
  const double top = problem.bodies[problem.grains - 1].x[2];
  for (const ContactEquation& c : problem.contacts) {
    draw = draw * 1664525U + 1013904223U;
    const double z = problem.bodies[static_cast<std::size_t>(c.first)].x[2] / (1.01 * top);
    const auto slice = static_cast<std::size_t>(z * static_cast<double>(count));
    part.push_back(static_cast<std::int32_t>(draw >> 29 == 0 ? (draw >> 8) % count : slice));
  }
  return part;
}

TEST(BodyParts, SeeTheStiffnessAndTheHeavyBodiesOfTheWhole) {
  for (const double plate : {0.0, 1e4}) {
    BodyProblem whole = block(3, 12, 0.35, plate);
    whole.bodies[40].mass = 100;
    const double expected = estimate_stiffness(whole);
    for (const std::size_t count : {std::size_t{2}, std::size_t{7}}) {
      const Cut cut(whole, by_height(whole, count), count);
      const BodyParts parts(cut.parts, cut);
      EXPECT_NEAR(estimate_stiffness(parts), expected, 1e-12 * expected);
      const auto heavy = heavy_unknowns(parts);
      std::vector<std::size_t> names;
      for (std::size_t p = 0; p < count; ++p)
        for (std::int32_t b : heavy[p]) names.push_back(cut.name(p, static_cast<std::size_t>(b)));
      std::sort(names.begin(), names.end());
      EXPECT_EQ(names,
                plate > 0 ? (std::vector<std::size_t>{40, whole.grains}) : std::vector<std::size_t>{40});
    }
  }
}

TEST(BodyParts, FindALongRowBesideOneGrainOnAFloor) {
  constexpr std::int32_t row = 200;
  BodyProblem problem = block(1, row, 0, 0);
  problem.contacts.front().first = row;  // the floor holds another grain
  problem.bodies.push_back(problem.bodies.front());
  ++problem.grains;
  EXPECT_GT(estimate_stiffness(problem), 0.3 * row * row);
  std::vector<std::int32_t> part;
  for (std::int32_t k = 0; k < row; ++k) part.push_back(3 * k / row);
  const Cut cut(problem, part, 3);
  EXPECT_GT(estimate_stiffness(BodyParts(cut.parts, cut)), 0.1 * row * row);  // from another end or middle
}

TEST(BodyParts, FindTheHeaviestBodyWhereNothingHoldsThem) {
  BodyProblem whole = block(2, 8, 0.35, 0);
  std::erase_if(whole.contacts, [](const ContactEquation& c) { return c.second < 0; });
  whole.impulse.resize(whole.contacts.size());
  whole.bodies[17].mass = 50;
  const double expected = estimate_stiffness(whole);
  EXPECT_GT(expected, 0);
  const Cut cut(whole, by_height(whole, 5), 5);
  EXPECT_NEAR(estimate_stiffness(BodyParts(cut.parts, cut)), expected, 1e-12 * expected);
}

/// (B r).s = r.(B s) of the preconditioner shows in its effect: conjugate gradients come to an end, on the
/// same solution, in about as many steps.
TEST(BodyParts, SolveTheLinearSystemOfTheWhole) {
  for (const double mu : {0.35, 0.0}) {
    BodyProblem whole = block(4, 16, mu, 1e3);
    const auto solve = [&](std::span<const BodyProblem> problems, const PartLink& link, PartField& V) {
      const BodyParts parts(problems, link);
      std::vector<std::vector<double>> rho(parts.size());
      PartField f = parts.field();
      V = parts.field();
      for (std::size_t p = 0; p < parts.size(); ++p) {
        for (const ContactEquation& c : parts[p].contacts)
          rho[p].push_back(1e3 * effective_mass(parts[p], c));
        for (std::size_t b = 0; b < f[p].size(); ++b)
          f[p][b].u = parts[p].bodies[b].mass * parts[p].bodies[b].free.u;
      }
      return BodySolver(parts, rho, 16).solve(f, V, 1e-10, 1000);
    };
    const PartLink alone;
    PartField expected, V;
    const int steps = solve({&whole, 1}, alone, expected);
    ASSERT_LT(steps, 200);
    for (const std::size_t count : {std::size_t{3}, std::size_t{8}}) {
      const Cut cut(whole, by_height(whole, count), count);
      EXPECT_LE(solve(cut.parts, cut, V), 2 * steps) << "mu " << mu << ", parts " << count;
      for (std::size_t p = 0; p < count; ++p)
        for (std::size_t b = 0; b < V[p].size(); ++b) {
          const Twist& due = expected[0][cut.name(p, b)];
          EXPECT_LT((V[p][b].u - due.u).norm() + (V[p][b].w - due.w).norm(), 1e-8 * 0.01)
              << "mu " << mu << ", parts " << count << ", body " << cut.name(p, b);
        }
    }
  }
}

TEST(BodyParts, CarryTheLoadOfTheWhole) {
  for (const double mu : {0.35, 0.0}) {
    BodyProblem whole = block(3, 10, mu, 1e4);
    const double load = 1e4 * 0.01 + static_cast<double>(whole.grains) * 0.01;
    const BodyAdmmSettings settings{.tolerance = 1e-7, .balance_tolerance = 1e-4, .max_iterations = 300};
    const auto on_the_floor = [&](std::span<const Vec3> r) {
      double sum = 0;
      for (std::size_t k = 0; k < whole.contacts.size(); ++k)
        if (whole.contacts[k].second < 0) sum += r[k][2];
      return sum;
    };
    const BodyProblem cold = whole;
    const int alone = solve_admm(whole, settings).iterations;
    EXPECT_NEAR(on_the_floor(whole.impulse), load, 1e-3 * load);
    for (const std::size_t count : {std::size_t{4}, std::size_t{9}}) {
      Cut cut(cold, by_height(cold, count), count);
      const BodyAdmmResult result = solve_admm(cut.parts, cut, settings);
      EXPECT_TRUE(result.converged);
      EXPECT_LE(result.iterations, 2 * alone);
      EXPECT_NEAR(on_the_floor(cut.impulses(cold.contacts.size())), load, 1e-3 * load);
    }
  }
}

}  // namespace
}  // namespace talus
