/// [sample] kind = "state": runs that begin where another one was.

#include <algorithm>

#include "io/results/results.hpp"
#include "tests/mpi/launcher.hpp"

namespace talus::state_sample_test {
namespace {

using namespace test;

class BegunFromAState : public OnRanks {
 protected:
  void SetUp() override {
    std::string branch = six_subdomains;
    const std::string allowed = "allow_unconverged = true\n";
    branch.erase(branch.find(allowed), allowed.size());
    write(at("compact.toml"), branch);
    const std::size_t begin = branch.find("kind = "), end = branch.find("[[wall]]");
    branch.replace(begin, end - begin, "kind = \"state\"\nfile = \"compact/results.h5\"\n\n");
    branch.replace(branch.find("[[stage]]"),
                   branch.find("[[stage]]\nname = \"hold\"") - branch.find("[[stage]]"), "");
    write(at("branch.toml"), branch);
    ASSERT_EQ(
        run(1,
            "run compact.toml --out compact --resume --threads 1 --set solver.max_iterations=3000 --set "
            "output.every_steps=1")
            .code,
        0);
  }
};

TEST_F(BegunFromAState, IsWhereTheStateWas) {
  ASSERT_EQ(run(1, "run branch.toml --out branch --threads 1 --set allow_unconverged=true").code, 0);
  const fs::path from = at("compact/results.h5");
  const Frame last = io::read_frame(from, io::frame_count(from) - 1);
  const Frame first = io::read_frame(at("branch/results.h5"), 0);
  EXPECT_EQ(first.id, last.id);
  EXPECT_EQ(first.x, last.x);
  EXPECT_EQ(first.u, last.u);
  for (std::size_t w = 0; w < last.walls.size(); ++w)
    EXPECT_EQ(first.walls[w].position, last.walls[w].position);
  // An earlier frame is another state.
  ASSERT_EQ(
      run(1, "run branch.toml --out other --threads 1 --set sample.frame=2 --set allow_unconverged=true")
          .code,
      0);
  EXPECT_EQ(io::read_frame(at("other/results.h5"), 0).x, io::read_frame(from, 2).x);
  EXPECT_EQ(run(1, "run branch.toml --out none --set sample.frame=2000").code, 2);
}

// Forces come along: the first step has less to find, from a frame and from a checkpoint alike. (A cold step
// of so few grains is put right by a direct solve, so it is not dearer by more.)
TEST_F(BegunFromAState, BeginsFromItsForcesOnAnyRanks) {
  const auto first_step = [&](const std::string& out) {
    return read_table(at(out) / "steps.csv").number(0, "iterations");
  };
  const std::string line = "run branch.toml --force --threads 1 --set solver.max_iterations=3000 --out ";
  ASSERT_EQ(run(1, line + "warm").code, 0);
  ASSERT_EQ(run(1, line + "cold --set solver.warm_start=false").code, 0);
  const std::string checkpoint = " --set sample.file=compact/checkpoint_000010.h5";
  ASSERT_EQ(run(1, line + "point" + checkpoint).code, 0);
  EXPECT_LT(first_step("warm"), 0.8 * first_step("cold"));
  EXPECT_LT(first_step("point"), 0.8 * first_step("cold"));
  for (const int ranks : {2, 3}) {
    ASSERT_EQ(run(ranks, line + "ranks").code, 0);
    EXPECT_EQ(digest_of("ranks"), digest_of("warm")) << ranks;
    ASSERT_EQ(run(ranks, line + "ranks" + checkpoint).code, 0);
    EXPECT_EQ(digest_of("ranks"), digest_of("point")) << ranks;
  }
  ASSERT_EQ(run(1, line + "alone --set decomposition.subdomains=1").code, 0);
  EXPECT_LT(first_step("alone"), 0.8 * first_step("cold"));
  // A run that began from a state is stopped and goes on as any other.
  ASSERT_EQ(
      run(1, "run branch.toml --threads 1 --set solver.max_iterations=3000 --out parts --resume --steps 2")
          .code,
      0);
  ASSERT_EQ(run(2, "run branch.toml --threads 1 --set solver.max_iterations=3000 --out parts --resume").code,
            0);
  EXPECT_EQ(digest_of("parts"), digest_of("warm"));
}

/// A dilute gas that goes with the flow of a sheared cell; the shear [m] that it begins with, and the sample.
constexpr const char* sheared_gas = R"(name = "gas"
time_step = 1e-4
[material]
density = 2600
[cell]
lengths = [0.1, 0.1, 0.1]
shears = [{}, 0.0, 0.0]
[sample]
{}
[[stage]]
shear_rates = [20.0, 0.0, 0.0]
end = {{ steps = 15 }}
[output]
every_steps = 5
pictures = false
[checkpoint]
every_steps = 5
)";

class BegunInACell : public OnRanks {
 protected:
  void SetUp() override {
    write(at("gas.toml"),
          fmt::format(fmt::runtime(sheared_gas), 0.0, "kind = \"random\"\ncount = 40\nradius = 1e-3"));
    ASSERT_EQ(run(1, "run gas.toml --out gas --threads 1").code, 0);
  }
  /// The largest velocity of a grain against the flow [m/s].
  double against_the_flow(const std::string& out) const {
    const Frame frame = last_frame(out);
    double most = 0;
    for (std::size_t k = 0; k < frame.x.size(); ++k)
      most = std::max(most, (frame.u[k] - Vec3(20 * frame.x[k][1], 0, 0)).norm());
    return most;
  }
};

TEST_F(BegunInACell, GrainsGoOnWithTheFlowAndNotTwiceAsFast) {
  ASSERT_LT(against_the_flow("gas"), 1e-12);
  const double shear = last_frame("gas").domain.cell.xy;
  ASSERT_GT(shear, 1e-3);
  for (const std::string from : {"results.h5", "checkpoint_000015.h5"}) {
    write(at("branch.toml"),
          fmt::format(fmt::runtime(sheared_gas), shear, "kind = \"state\"\nfile = \"gas/" + from + "\""));
    const Outcome branch = run(1, "run branch.toml --out branch --force --threads 1");
    ASSERT_EQ(branch.code, 0) << from << branch.messages;
    EXPECT_LT(against_the_flow("branch"), 1e-12) << from;
  }
}

// A contact across a face of the cell presses as it did: from a frame, which keeps normals, and from a
// checkpoint, where they are found again.
TEST_F(BegunInACell, ForcesAcrossItsFacesComeAlong) {
  const std::string squeezed = R"(time_step = 1e-4
allow_unconverged = true
[material]
density = 2600
friction = 0.3
[cell]
lengths = [{0}, {0}, {0}]
[sample]
{1}
[[stage]]
friction = {2}
strain_rates = [-5.0, -5.0, -5.0]
end = {{ steps = {3} }}
[solver]
tolerance = 1e-6
[output]
every_steps = 500
pictures = false
[checkpoint]
every_steps = 425
)";
  write(at("press.toml"), fmt::format(fmt::runtime(squeezed), 0.0094,
                                      "kind = \"random\"\ncount = 60\nradius_distribution = \"uniform\"\n"
                                      "radius_min = 0.0009\nradius_max = 0.0011",
                                      0, 425));
  ASSERT_EQ(run(1, "run press.toml --out press --threads 1").code, 0);
  const double edge = last_frame("press").domain.cell.xx;
  std::vector<double> errors;
  for (const std::string from : {"results.h5", "checkpoint_000425.h5"}) {
    write(at("go.toml"), fmt::format(fmt::runtime(squeezed), edge,
                                     "kind = \"state\"\nfile = \"press/" + from + "\"", 0.3, 1));
    const Outcome go = run(1, "run go.toml --out go --force --threads 1 --error-history 1");
    ASSERT_EQ(go.code, 0) << go.messages;
    errors.push_back(read_table(at("go/error_history.csv")).number(0, "error_rms"));
  }
  // Normals of a frame are those of the step's beginning.
  EXPECT_NEAR(errors[1], errors[0], 0.01 * errors[0]);
  EXPECT_LT(errors[0], 0.5) << "forces came along at all";
}

TEST_F(BegunInACell, AnotherCellThanThatOfTheStateIsRefused) {
  for (const std::string from : {"results.h5", "checkpoint_000015.h5"}) {
    write(at("branch.toml"),
          fmt::format(fmt::runtime(sheared_gas), 0.0, "kind = \"state\"\nfile = \"gas/" + from + "\""));
    const Outcome branch = run(1, "run branch.toml --out branch --threads 1");
    EXPECT_EQ(branch.code, 2) << from;
    EXPECT_NE(branch.messages.find("shears = [0.00"), std::string::npos) << branch.messages;
    EXPECT_FALSE(fs::exists(at("branch")));
  }
}

class StateOfClumps : public OnRanks {};

/// Frames have their bounding spheres only: as grains these overlap.
TEST_F(StateOfClumps, IsRefusedAlsoWhereTheSceneHasNone) {
  const std::string rest =
      "[material]\ndensity = 2600\n[[wall]]\nname = \"z-\"\nposition = 0\n"
      "[[stage]]\ntime_step = 1e-3\nend = { steps = 2 }\n[checkpoint]\nevery_steps = 2\n";
  write(at("rods.toml"), rest +
                             "[sample]\nkind = \"lattice\"\nshape = \"dumbbell\"\ncells = [2, 2, 2]\nspacing "
                             "= 1\nradius = 0.02\n");
  ASSERT_EQ(run(1, "run rods.toml --out rods --threads 1").code, 0);
  for (const std::string from : {"results.h5", "checkpoint_000002.h5"}) {
    write(at("branch.toml"), rest + "[sample]\nkind = \"state\"\nfile = \"rods/" + from + "\"\n");
    const Outcome branch = run(1, "run branch.toml --out branch --threads 1");
    EXPECT_EQ(branch.code, 2) << from;
    EXPECT_NE(branch.messages.find("states of clumps"), std::string::npos) << branch.messages;
    EXPECT_FALSE(fs::exists(at("branch")));
  }
}

}  // namespace
}  // namespace talus::state_sample_test
