/// [sample] kind = "state": runs that begin where another one was.

#include <algorithm>
#include <numbers>

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

// A sample that was pressed once is sheared under a stress that rises: it is not let go first.
TEST_F(BegunInACell, ARampBeginsFromTheStressThatTheStateBears) {
  const std::string cell = R"(
time_step = 1e-4
[material]
density = 2600
[cell]
lengths = [{0}]
[sample]
{1}
[[stage]]
name = "go"
stress = {{ xx = {2}, yy = {2}, zz = {2}, ramp_time = {3} }}
end = {{ steps = {4} }}
[decomposition]
subdomains = 2
[output]
every_steps = 1
pictures = false
)";
  const std::string grains =
      "kind = \"random\"\ncount = 60\nradius_distribution = \"uniform\"\nradius_min = 0.0009\n"
      "radius_max = 0.0011";
  write(at("press.toml"), fmt::format(fmt::runtime(cell), "0.0094, 0.0094, 0.0094", grains, 1000, 0, 600));
  ASSERT_EQ(run(1,
                "run press.toml --out press --threads 1 --set checkpoint.every_steps=600 --set "
                "allow_unconverged=true")
                .code,
            0);
  const PeriodicSpace pressed = last_frame("press").domain.cell;
  const std::string edges = fmt::format("{}, {}, {}", pressed.xx, pressed.yy, pressed.zz);
  for (const std::string from : {"results.h5", "checkpoint_000600.h5"}) {
    write(at("go.toml"), fmt::format(fmt::runtime(cell), edges,
                                     "kind = \"state\"\nfile = \"press/" + from + "\"", 3000, 0.2, 10));
    const auto pressure = [&](const std::string& out) {
      const auto table = read_table(at(out) / "cell.csv");
      const auto row = table.rows.size() - 1;
      double sum = 0;
      for (const std::string axis : {"xx", "yy", "zz"})
        sum += table.number(row, "stress_" + axis) + table.number(row, "kinetic_" + axis);
      return sum / 3;
    };
    ASSERT_EQ(run(1, "run go.toml --out go --force --threads 1").code, 0);
    EXPECT_NEAR(pressure("go"), 1000 + 2000 * 0.00095 / 0.2, 3) << from;
    // What the state bore is not asked of it again behind a stop, and other ranks are told.
    fs::remove_all(at("parts"));
    ASSERT_EQ(run(2, "run go.toml --out parts --resume --threads 1 --steps 3").code, 0);
    ASSERT_EQ(run(1, "run go.toml --out parts --resume --threads 1").code, 0);
    EXPECT_EQ(digest_of("parts"), digest_of("go")) << from;
  }
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

class StateOfMaterials : public OnRanks {
 protected:
  /// A light and a heavy grain on a floor, or the state of them.
  std::string scene(const std::string& materials, const std::string& sample) const {
    return "gravity = [0, 0, -9.81]\n" + materials + sample +
           "[[wall]]\nname = \"z-\"\nposition = 0\n[[stage]]\ntime_step = 1e-4\nend = { steps = 5 }\n"
           "[checkpoint]\nevery_steps = 5\n";
  }
  const std::string glass = "[[material]]\nname = \"glass\"\ndensity = 2500\n";
  const std::string lead = "[[material]]\nname = \"lead\"\ndensity = 11000\n";
  const std::string bodies =
      "[[sample]]\nkind = \"body\"\nname = \"g\"\nmaterial = \"glass\"\nradius = 0.01\n"
      "position = [0, 0, 0.01]\n"
      "[[sample]]\nkind = \"body\"\nname = \"l\"\nmaterial = \"lead\"\nradius = 0.01\n"
      "position = [0.1, 0, 0.01]\n";
  std::string state(const std::string& file, const std::string& more = "") const {
    return "[[sample]]\nkind = \"state\"\nfile = \"first/" + file + "\"\n" + more;
  }
  double torque(const std::string& out) const {
    const auto walls = read_table(at(out) / "walls.csv");
    return walls.number(walls.rows.size() - 1, "torque_y");
  }
};

TEST_F(StateOfMaterials, AreThoseOfTheSameName) {
  write(at("first.toml"), scene(glass + lead, bodies));
  ASSERT_EQ(run(1, "run first.toml --out first --threads 1").code, 0);
  const double weight = 11000 * 4.0 / 3 * std::numbers::pi * 1e-6 * 9.81;
  ASSERT_NEAR(torque("first"), -0.1 * weight, 1e-6 * weight);
  for (const std::string file : {"results.h5", "checkpoint_000005.h5"}) {
    write(at("other.toml"),
          scene(lead + "[[material]]\nname = \"steel\"\ndensity = 7800\n" + glass, state(file)));
    const Outcome other = run(1, "run other.toml --out other --force --threads 1");
    ASSERT_EQ(other.code, 0) << other.messages;
    EXPECT_NEAR(torque("other"), -0.1 * weight, 1e-6 * weight) << file;
  }
}

TEST_F(StateOfMaterials, ThatTheSceneDoesNotNameAreRefused) {
  write(at("first.toml"), scene(glass + lead, bodies));
  ASSERT_EQ(run(1, "run first.toml --out first --threads 1").code, 0);
  const auto refused = [&](const std::string& text, const std::string& said) {
    write(at("other.toml"), text);
    const Outcome other = run(1, "run other.toml --out other --threads 1");
    EXPECT_EQ(other.code, 2);
    EXPECT_NE(other.messages.find(said), std::string::npos) << other.messages;
    EXPECT_FALSE(fs::exists(at("other")));
  };
  for (const std::string file : {"results.h5", "checkpoint_000005.h5"}) {
    refused(scene(glass + "[[material]]\nname = \"steel\"\ndensity = 7800\n", state(file)),
            "the scene has no [[material]] of that name");
    refused(scene("[material]\ndensity = 2500\n", state(file)), "of several materials");
    refused(scene(glass + lead, state(file, "material = \"lead\"\n")), "leave `material = \"lead\"` out");
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
