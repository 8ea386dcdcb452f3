/// The command on several ranks: same bits, one set of files, errors that end all ranks.

#include <fmt/format.h>

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
    EXPECT_EQ(content(folder_ / out / "fields" / "grains_000001.vtp"),
              content(folder_ / "one" / "fields" / "grains_000001.vtp"))
        << out;
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
