/// The command on several ranks: same bits, one set of files, errors that end all ranks.

#include <fmt/format.h>

#include <algorithm>

#include "io/results.hpp"
#include "tests/validation/command_helpers.hpp"

namespace talus::test {
namespace {

const std::string scene = R"(name = "ranks"
box = true
time_step = 1e-3
[material]
density = 2600
friction = 0.3
[sample]
kind = "deposition"
count = 300
base = [0.12, 0.12]
radius_distribution = "uniform"
radius_min = 0.008
radius_max = 0.012
[[wall]]
name = "z+"
drive = "pressure"
pressure = 1e4
[[stage]]
name = "press"
friction = 0
end = { steps = 6 }
[[stage]]
name = "hold"
end = { steps = 6 }
[solver]
max_iterations = 60
[decomposition]
subdomains = 6
[output]
every_steps = 4
)";

class Ranks : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("talus_ranks_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    write(folder_ / "scene.toml", scene);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string launcher(int ranks) {
    return "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe --bind-to none "
           "-n " +
           std::to_string(ranks);
  }
  std::string digest_of(const std::string& out) const {
    return nlohmann::json::parse(content(folder_ / out / "run.json"))["summary"]["digest"];
  }
  static void expect_same_frames(const fs::path& one, const fs::path& other) {
    ASSERT_GT(io::frame_count(one), 1u);
    ASSERT_EQ(io::frame_count(one), io::frame_count(other)) << one;
    for (std::size_t k = 0; k < io::frame_count(one); ++k) {
      const Frame a = io::read_frame(one, k), b = io::read_frame(other, k);
      EXPECT_EQ(a.step, b.step);
      EXPECT_EQ(a.stage, b.stage);
      EXPECT_EQ(a.id, b.id) << one << " frame " << k;
      EXPECT_TRUE(std::ranges::is_sorted(a.id));
      EXPECT_EQ(a.x, b.x);
      EXPECT_EQ(a.radius, b.radius);
      EXPECT_EQ(a.u, b.u);
      EXPECT_EQ(a.omega, b.omega);
      EXPECT_EQ(a.contact_bodies, b.contact_bodies);
      EXPECT_EQ(a.contact_point, b.contact_point);
      EXPECT_EQ(a.contact_normal, b.contact_normal);
      EXPECT_EQ(a.contact_gap, b.contact_gap);
      EXPECT_EQ(a.contact_force, b.contact_force);
      ASSERT_EQ(a.walls.size(), b.walls.size());
      for (std::size_t w = 0; w < a.walls.size(); ++w) EXPECT_EQ(a.walls[w].force, b.walls[w].force);
    }
  }
  fs::path folder_;
};

TEST_F(Ranks, ChangeNoBitOfAnyResult) {
  const Outcome one = run(folder_, "run scene.toml --out one --threads 1");
  ASSERT_EQ(one.code, 3) << one.messages;
  for (const auto& [ranks, threads] : {std::pair{1, 2}, {2, 1}, {2, 2}, {3, 1}, {4, 1}}) {
    const std::string out = fmt::format("r{}x{}", ranks, threads);
    const std::string arguments = fmt::format("run scene.toml --out {} --threads {}", out, threads);
    const Outcome other = run(folder_, arguments, ranks > 1 ? launcher(ranks) : "");
    ASSERT_EQ(other.code, 3) << out << ": " << other.messages;
    EXPECT_EQ(digest_of(out), digest_of("one")) << out;
    EXPECT_EQ(content(folder_ / out / "walls.csv"), content(folder_ / "one" / "walls.csv")) << out;
    EXPECT_EQ(content(folder_ / out / "triaxial.csv"), content(folder_ / "one" / "triaxial.csv")) << out;
    for (const char* name : {"fields/grains_000001.vtp", "fields/forces_000001.vtp", "forces.svg"})
      EXPECT_EQ(content(folder_ / out / name), content(folder_ / "one" / name)) << out << ' ' << name;
    expect_same_frames(folder_ / out / "results.h5", folder_ / "one" / "results.h5");
  }
}

TEST_F(Ranks, MoreThanSubdomainsAreRefusedByAll) {
  const Outcome outcome =
      run(folder_, "run scene.toml --out refused --threads 1 --set decomposition.subdomains=2", launcher(3));
  EXPECT_EQ(outcome.code, 2) << outcome.messages;
  EXPECT_NE(outcome.messages.find("3 ranks for 2 subdomains"), std::string::npos) << outcome.messages;
  EXPECT_FALSE(fs::exists(folder_ / "refused"));
}

TEST_F(Ranks, EndTogetherOnBadInput) {
  const Outcome outcome = run(folder_, "run missing.toml --threads 1", launcher(2));
  EXPECT_EQ(outcome.code, 2) << outcome.messages;
}

TEST_F(Ranks, BearMessagesThatComeLate) {
  ASSERT_EQ(run(folder_, "run scene.toml --out one --threads 1 --steps 3").code, 3);
  const Outcome late = run(folder_, "run scene.toml --out late --threads 1 --steps 3",
                           "TALUS_MESSAGE_DELAY=2e-4 " + launcher(2));
  ASSERT_EQ(late.code, 3) << late.messages;
  EXPECT_EQ(digest_of("late"), digest_of("one"));
}

}  // namespace
}  // namespace talus::test
