/// What `talus run` asks of single contacts, and whom it names where they are missed.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus {
namespace {

using namespace test;

class Tolerances : public CommandTest {
 protected:
  double largest(const std::string& results, const std::string& column) const {
    const Table steps = read_table(at(results) / "steps.csv");
    double most = 0;
    for (std::size_t k = 0; k < steps.rows.size(); ++k) most = std::max(most, steps.number(k, column));
    return most;
  }
};

// 400 grains at rest on the floor, and far from them a column of 210, ids 1000 to 1209, that stands on grain
// 1000: too large for a direct check, too long for five sweeps.
TEST_F(Tolerances, NameTheContactAndTheBodyThatAStepMissed) {
  std::string grains = "id,x,y,z,radius\n";
  for (int k = 0; k < 400; ++k)
    grains += std::to_string(k) + "," + std::to_string(0.05 * (k % 20)) + "," +
              std::to_string(0.05 * (k / 20)) + ",0.01,0.01\n";
  for (int k = 0; k < 210; ++k)
    grains += std::to_string(1000 + k) + ",2,2," + std::to_string(0.01 + 0.02 * k) + ",0.01\n";
  write(at("grains.csv"), grains);
  write(at("scene.toml"), with_bodies(column_scene));
  const std::string few = "run scene.toml --set solver.method=nlgs --set solver.max_iterations=5 ";
  const Outcome outcome = run(few + "--out results");
  EXPECT_EQ(outcome.code, 3) << outcome.messages;
  const Table steps = read_table(at("results/steps.csv"));
  ASSERT_EQ(steps.rows.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(steps.rows[k].at("converged"), "0");
    const double body = steps.number(k, "worst_contact_body"), with = steps.number(k, "worst_contact_with");
    EXPECT_GE(body, 1000);
    EXPECT_TRUE(with == body + 1 || (body == 1000 && with == -1)) << body << " and " << with;
    EXPECT_GE(steps.number(k, "worst_body"), 1000);
    EXPECT_GT(steps.number(k, "worst_body_error"), 0);
  }
  EXPECT_NE(outcome.messages.find("is the furthest off: at the contact of bod"), std::string::npos)
      << outcome.messages;

  EXPECT_EQ(run(few + "--set decomposition.subdomains=3 --set decomposition.partitioner=rcb --out cut").code,
            3);
  const Table cut = read_table(at("cut/steps.csv"));
  EXPECT_GE(cut.number(0, "worst_contact_body"), 1000);

  EXPECT_EQ(run("run scene.toml --out done").code, 0);
  const Table done = read_table(at("done/steps.csv"));
  EXPECT_EQ(done.rows[3].at("converged"), "1");
  EXPECT_EQ(done.rows[3].at("worst_contact_body"), "-1");
  EXPECT_EQ(done.number(3, "worst_body_error"), 0);
}

/// A hundred grains, laid with friction, in the first step: within so few sweeps nobody knows who holds whom.
TEST_F(Tolerances, WarnOfSmallClustersWithoutAnAnswer) {
  write(at("scene.toml"), R"(time_step = 1e-3
gravity = [0, 0, -9.81]
box = true
[material]
density = 2600
friction = 0.5
[sample]
kind = "deposition"
count = 100
base = [0.08, 0.08]
radius_distribution = "uniform"
radius_min = 0.006
radius_max = 0.012
[[stage]]
end = { steps = 1 }
)");
  const std::string few = "run scene.toml --force --out results --set solver.max_iterations=5";
  const Outcome outcome = run(few);
  EXPECT_EQ(outcome.code, 3) << outcome.messages;
  // At least that, and more where the best of the rounds that did not settle would change more.
  EXPECT_GE(read_table(at("results/steps.csv")).number(0, "balance"), 1);
  EXPECT_NE(outcome.messages.find("in 1 step nothing is known"), std::string::npos) << outcome.messages;
  EXPECT_NE(outcome.messages.find("solver.direct_bodies = 0"), std::string::npos) << outcome.messages;
  const Outcome left = run(few + " --set solver.direct_bodies=0");
  EXPECT_EQ(left.messages.find("its direct solve"), std::string::npos) << left.messages;
}

// A lid of a gram that 150 N push: two sweeps leave it falling at many times what any grain has.
TEST_F(Tolerances, NameAWallWhereThatIsFurthestOff) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome =
      run("run scene.toml --out results --set wall.z+.mass=1e-3 --set solver.method=nlgs --set "
          "solver.max_iterations=2 --set solver.check_every=2 --set solver.tolerance=1e-6");
  EXPECT_EQ(outcome.code, 3);
  const Table steps = read_table(at("results/steps.csv"));
  EXPECT_EQ(steps.rows[0].at("worst_body"), "-6") << "the sixth of x-, x+, y-, y+, z-, z+";
  EXPECT_NE(outcome.messages.find("and wall 'z+' by "), std::string::npos) << outcome.messages;
}

// Each bound is missed where nothing asks for it, and kept where it is asked.
TEST_F(Tolerances, OfTheWorstContactAndOfMostOfThemAreKept) {
  write(at("scene.toml"), pressed_box);
  const std::string plain = "run scene.toml --set solver.tolerance=1e-2 --set solver.balance_tolerance=1 ";
  ASSERT_EQ(run(plain + "--out loose --set solver.quantile_tolerance=1e3").code, 0);
  const double worst = largest("loose", "error_max"), most = largest("loose", "error_quantile");
  EXPECT_GT(worst, most);
  EXPECT_GT(most, 0);
  ASSERT_EQ(run(plain + "--out worst --set solver.max_tolerance=" + std::to_string(0.3 * worst)).code, 0);
  EXPECT_LE(largest("worst", "error_max"), 0.3 * worst);
  ASSERT_EQ(run(plain + "--out most --set solver.quantile_tolerance=" + std::to_string(0.3 * most)).code, 0);
  EXPECT_LE(largest("most", "error_quantile"), 0.3 * most);
  EXPECT_EQ(largest("worst", "error_quantile"), 0) << "nobody asked for it";
}

// Friction leaves the forces in a bed of grains at rest free to creep, and nobody's velocity: some tens of
// sweeps from the impulses of the step before are enough for each step, and the answer that says so is found.
TEST_F(Tolerances, AreMetByABedAtRestWhoseForcesCreep) {
  write(at("bed.toml"), R"(gravity = [0, 0, -9.81]
time_step = 5e-4
[material]
density = 2600
friction = 0.4
wall_friction = 0.4
[sample]
kind = "deposition"
count = 190
base = [0.12, 0.12]
radius_distribution = "uniform"
radius_min = 0.010
radius_max = 0.015
[[wall]]
name = "x-"
[[wall]]
name = "x+"
[[wall]]
name = "y-"
[[wall]]
name = "y+"
[[wall]]
name = "floor"
side = "z-"
[[stage]]
name = "settle"
end = { steps = 40 }
[output]
pictures = false
)");
  const Outcome outcome = run("run bed.toml --out bed");
  EXPECT_EQ(outcome.code, 0) << outcome.messages;
  const Table steps = read_table(at("bed/steps.csv"));
  ASSERT_EQ(steps.rows.size(), 40U);
  double sweeps = 0;
  for (std::size_t k = 0; k < steps.rows.size(); ++k) sweeps += steps.number(k, "iterations");
  EXPECT_LE(sweeps, 40 * 50) << "36 a step were measured";
}

TEST_F(Tolerances, ThatMakeNoSenseAreRefused) {
  write(at("scene.toml"), pressed_box);
  for (const char* wrong :
       {"solver.max_tolerance=-1", "solver.quantile_tolerance=nan", "solver.quantile=2"}) {
    const Outcome outcome = run(std::string("run scene.toml --dry-run --set ") + wrong);
    EXPECT_EQ(outcome.code, 2) << wrong;
    EXPECT_NE(outcome.messages.find("solver."), std::string::npos) << outcome.messages;
  }
}

}  // namespace
}  // namespace talus
