/// The command on several ranks: same bits, one set of files, as many messages as the formulas say.

#include <algorithm>

#include "io/results/results.hpp"
#include "runtime/graph/tree.hpp"
#include "tests/mpi/launcher.hpp"

namespace talus::test {
namespace {

class Ranks : public OnRanks {
 protected:
  void SetUp() override { write(at("scene.toml"), six_subdomains); }

  /// The scene's line on what an exchange sends: between subdomains and between ranks.
  struct Sent {
    long messages = -1, bytes = -1, between_ranks = -1, bytes_between_ranks = -1;
  };
  static Sent sent(const Outcome& outcome) {
    Sent sent;
    const std::size_t line = outcome.messages.find("an exchange:");
    if (line != std::string::npos)
      std::sscanf(outcome.messages.c_str() + line,
                  "an exchange: %ld messages of %ld bytes between subdomains, %ld of %ld between ranks",
                  &sent.messages, &sent.bytes, &sent.between_ranks, &sent.bytes_between_ranks);
    return sent;
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
      EXPECT_EQ(a.contact_moment, b.contact_moment);
      EXPECT_EQ(a.contact_force, b.contact_force);
      ASSERT_EQ(a.walls.size(), b.walls.size());
      for (std::size_t w = 0; w < a.walls.size(); ++w) EXPECT_EQ(a.walls[w].force, b.walls[w].force);
    }
  }
};

TEST_F(Ranks, ChangeNoBitOfAnyResult) {
  const std::string all_files = "run scene.toml --set output.contacts=true --set output.pictures=true";
  const Outcome one = run(1, all_files + " --out one --threads 1");
  ASSERT_EQ(one.code, 0) << one.messages;
  for (const auto& [ranks, threads] : {std::pair{1, 2}, {2, 1}, {2, 2}, {3, 1}, {4, 1}, {4, 2}}) {
    const std::string out = fmt::format("r{}x{}", ranks, threads);
    const Outcome other = run(ranks, fmt::format("{} --out {} --threads {}", all_files, out, threads));
    ASSERT_EQ(other.code, 0) << out << ": " << other.messages;
    EXPECT_EQ(digest_of(out), digest_of("one")) << out;
    for (const std::string name :
         {"walls.csv", "triaxial.csv", "fields/grains_000001.vtp", "fields/forces_000001.vtp", "forces.svg"})
      EXPECT_EQ(file(out, name), file("one", name)) << out << ", " << name;
    expect_same_frames(at(out) / "results.h5", at("one") / "results.h5");
  }
}

// With more than nine ranks some hand on what others tell the top (runtime/graph/tree.hpp).
TEST_F(Ranks, HandOnWhatOthersSayToTheBit) {
  constexpr int ranks = 12;
  const std::vector<graph::RankLoad> alike(ranks);
  const graph::Tree tree = graph::grow_tree(alike);
  ASSERT_GT(std::ranges::count_if(tree.order, [&](int rank) { return tree.relays(rank); }), 0);
  for (const std::string keys : {"subdomains=12", "subdomains=12 --set decomposition.exchange=ccs",
                                 "subdomains=36 --set decomposition.mapping=cyclic",
                                 "subdomains=36 --set decomposition.coupling=nscdd"}) {
    const std::string twelve = "run scene.toml --force --steps 3 --threads 1 --set decomposition." + keys;
    const Outcome one = run(1, twelve + " --out one"), other = run(ranks, twelve + " --out other");
    ASSERT_EQ(one.code, 0) << keys << ": " << one.messages;
    ASSERT_EQ(other.code, one.code) << keys << ": " << other.messages;
    EXPECT_EQ(digest_of("other"), digest_of("one")) << keys;
    EXPECT_EQ(file("other", "walls.csv"), file("one", "walls.csv")) << keys;
  }
}

// One rank ends a step at the check that certifies it; several learn of it a sweep later, and go back.
TEST_F(Ranks, EndStepsOnTheStateThatWasCertified) {
  for (const std::string method : {"auto", "nlgs", "nncg"}) {
    const std::string keys =
        "run scene.toml --force --threads 1 --set solver.tolerance=0.02 --set solver.balance_tolerance=1e9 "
        "--set solver.max_iterations=400 --set solver.method=" +
        method;
    const Outcome one = run(1, keys + " --out one");
    ASSERT_EQ(one.code, 0) << method << ": " << one.messages;
    for (int ranks : {2, 3}) {
      const Outcome several = run(ranks, keys + " --out several");
      ASSERT_EQ(several.code, 0) << method << ": " << several.messages;
      EXPECT_EQ(digest_of("several"), digest_of("one")) << method << ", " << ranks;
      EXPECT_EQ(file("several", "triaxial.csv"), file("one", "triaxial.csv")) << method << ", " << ranks;
    }
  }
}

TEST_F(Ranks, MayHaveAnySubdomainsOfAllCouplings) {
  for (const std::string coupling : {"nscdd", "alternating", "schwarz"})
    for (const std::string exchange : {"dcs", "ccs"}) {
      const std::string keys = fmt::format(
          "run scene.toml --force --threads 1 --set decomposition.coupling={} --set "
          "decomposition.exchange={}",
          coupling, exchange);
      ASSERT_EQ(run(1, keys + " --out one").code, 0);
      // All of them once; with three ranks, neighbours in number are never neighbours on a rank.
      for (int ranks : coupling + exchange == "nscddccs" || coupling + exchange == "alternatingdcs"
                           ? std::vector{2, 3, 4}
                           : std::vector{3}) {
        const Outcome dealt = run(ranks, keys + " --out dealt --set decomposition.mapping=cyclic");
        ASSERT_EQ(dealt.code, 0) << dealt.messages;
        EXPECT_EQ(digest_of("dealt"), digest_of("one")) << coupling << " " << exchange << ", " << ranks;
        EXPECT_EQ(file("dealt", "walls.csv"), file("one", "walls.csv")) << coupling << " " << exchange;
      }
    }
  // Turns with nothing between a publish and who waits for it.
  const std::string eager = "run scene.toml --force --threads 1 --set decomposition.overlap=false";
  ASSERT_EQ(run(1, eager + " --out one").code, 0);
  ASSERT_EQ(run(3, eager + " --out dealt --set decomposition.mapping=cyclic").code, 0);
  EXPECT_EQ(digest_of("dealt"), digest_of("one"));
}

TEST_F(Ranks, SendOneMessagePerNeighbourOrToTheCentreAndBack) {
  // Three slices from wall to wall, each wider than a grain: two borders. The lid, moved by its pressure,
  // goes through the centre.
  const std::string sliced =
      "run scene.toml --force --out out --threads 1 --steps 2 --set decomposition.subdomains=3 "
      "--set decomposition.boxes=[3,1,1] --set decomposition.partitioner=boxes --set "
      "decomposition.exchange=";
  constexpr long subdomains = 3, borders = 2, lid = 3 * 8;
  const Sent alone = sent(run(1, sliced + "dcs"));
  EXPECT_EQ(alone.messages, 2 * borders + 2 * subdomains);
  EXPECT_EQ(alone.between_ranks, 0);
  for (int ranks : {2, 3}) {
    const Sent block = sent(run(ranks, sliced + "dcs"));
    EXPECT_EQ(block.messages, alone.messages) << ranks;
    EXPECT_EQ(block.bytes, alone.bytes) << ranks;
    EXPECT_EQ(block.between_ranks, 2 * (ranks - 1) + 2 * (ranks - 1)) << "borders of ranks, and the lid";
    const Sent cyclic = sent(run(ranks, sliced + "dcs --set decomposition.mapping=cyclic"));
    EXPECT_EQ(cyclic.bytes, alone.bytes) << ranks;
    EXPECT_EQ(cyclic.between_ranks, 2 * borders + 2 * (ranks - 1)) << "every border lies between ranks";
    // Than on the top: a rank with the outer slices alone, whose turn is the first.
    const long elsewhere = subdomains - (subdomains + ranks - 1) / ranks;
    EXPECT_EQ(cyclic.bytes_between_ranks, alone.bytes - 2 * subdomains * lid + (elsewhere + ranks - 1) * lid)
        << "the borders; the lid: a part from each subdomain elsewhere, one answer a rank";
    const Sent centre = sent(run(ranks, sliced + "ccs"));
    EXPECT_EQ(centre.messages, 2 * subdomains) << ranks;
    EXPECT_EQ(centre.between_ranks, 2 * (ranks - 1)) << "one for all subdomains of a rank";
  }
}

TEST_F(Ranks, BearMessagesThatComeLate) {
  const int code = run(1, "run scene.toml --out one --threads 1 --steps 3").code;
  ASSERT_EQ(code, 0);
  for (const std::string mapping : {"block", "cyclic"}) {
    const Outcome late = run(
        2, "run scene.toml --force --out late --threads 1 --steps 3 --set decomposition.mapping=" + mapping,
        "TALUS_MESSAGE_DELAY=2e-4");
    ASSERT_EQ(late.code, code) << late.messages;
    EXPECT_EQ(digest_of("late"), digest_of("one")) << mapping;
  }
}

TEST_F(Ranks, MoreThanSubdomainsAreRefusedByAll) {
  const Outcome outcome = run(3, "run scene.toml --out refused --threads 1 --set decomposition.subdomains=2");
  EXPECT_EQ(outcome.code, 2) << outcome.messages;
  EXPECT_NE(outcome.messages.find("3 ranks for 2 subdomains"), std::string::npos) << outcome.messages;
  EXPECT_FALSE(fs::exists(at("refused")));
}

TEST_F(Ranks, HaveTheThreadsThatTheirShareOfGrainsIsWorth) {
  const std::string loose =
      "time_step = 1e-3\nmaterial = { density = 2600 }\nstage = [{ end = { steps = 1 } }]\n"
      "output = { pictures = false }\n[sample]\nkind = \"lattice\"\ncount = 4000\nbase = [0.4, 0.4]\n"
      "radius = 0.01\n";
  write(at("scene.toml"), loose);
  ASSERT_EQ(run(2, "run scene.toml --out two").code, 0);
  EXPECT_EQ(nlohmann::json::parse(file("two", "run.json")).at("provenance").at("threads"), 1);
}

TEST_F(Ranks, EndTogetherOnBadInputAndWithMissedSteps) {
  const Outcome outcome = run(2, "run missing.toml --threads 1");
  EXPECT_EQ(outcome.code, 2) << outcome.messages;
  const Outcome missed = run(2, "run scene.toml --threads 1 --set allow_unconverged=false --out missed");
  EXPECT_EQ(missed.code, 3) << missed.messages;
}

// Rank 1 stands in another folder. It says so, with its number, where rank 0 found nothing wrong.
TEST_F(Ranks, SayWhichOfThemCannotReadTheScene) {
  fs::create_directory(at("elsewhere"));
  const std::string moved =
      " sh -c 'if [ $OMPI_COMM_WORLD_RANK -gt 0 ]; then cd elsewhere; fi; exec \"$0\" \"$@\"'";
  const Outcome one = test::run(folder_.path(), "run scene.toml --threads 1", launcher(3) + moved);
  EXPECT_EQ(one.code, 2) << one.messages;
  EXPECT_NE(one.messages.find("rank 1: scene.toml: cannot open"), std::string::npos) << one.messages;
  EXPECT_EQ(occurrences(one.messages, "cannot open"), 1u) << "once, not once a rank: " << one.messages;
  const Outcome all = run(3, "run missing.toml --threads 1");
  EXPECT_EQ(occurrences(all.messages, "cannot open"), 1u) << all.messages;
  EXPECT_EQ(all.messages.find("rank "), std::string::npos) << all.messages;
}

/// A floor, and the grains of `rows` (id,x,y,z,radius) that fall on it.
std::string on_a_floor(int subdomains, int steps) {
  return fmt::format(R"(gravity = [0, 0, -9.81]
time_step = 1e-3
[material]
density = 2600
friction = 0.3
[sample]
kind = "bodies"
file = "grains.csv"
[[wall]]
name = "floor"
side = "z-"
position = 0
[[stage]]
name = "fall"
end = {{ steps = {} }}
[decomposition]
subdomains = {}
[output]
pictures = false
)",
                     steps, subdomains);
}

// A grain is so fast that its energy is no number.
TEST_F(Ranks, EndARunawayTogetherWithAllFilesWhole) {
  write(at("scene.toml"), on_a_floor(3, 30));
  write(at("grains.csv"), "id,x,y,z,radius\n0,0,0,1,0.01\n7,1,0,1,0.01\n");
  const Outcome outcome = run(3, "run scene.toml --out burst --threads 1 --set gravity=[1e200,0,0]");
  EXPECT_EQ(outcome.code, 1) << outcome.messages;
  EXPECT_EQ(summary(at("burst")).at("status"), "failed");
  EXPECT_TRUE(summary(at("burst")).at("digest").is_null());
  EXPECT_NE(outcome.messages.find("results in burst"), std::string::npos) << outcome.messages;
  for (const std::string rank : {"rank 1: step 1 ", "rank 2: step 1 "})
    EXPECT_NE(outcome.messages.find(rank), std::string::npos) << outcome.messages;
}

TEST_F(Ranks, BearHavingNoGrainAtAll) {
  write(at("scene.toml"), on_a_floor(8, 30));
  write(at("grains.csv"), "id,x,y,z,radius\n5,0,0,0.0101,0.01\n");
  ASSERT_EQ(run(1, "run scene.toml --out one --threads 1").code, 0);
  for (int ranks : {2, 4}) {
    const Outcome several = run(ranks, "run scene.toml --force --out several --threads 1");
    ASSERT_EQ(several.code, 0) << several.messages;
    EXPECT_EQ(digest_of("several"), digest_of("one")) << ranks;
  }
}

// The right rank shares no grain at first, nor does a wall need the centre; then its grains fly into the
// others'.
TEST_F(Ranks, ThatShareNothingHearTheCentreAllTheSame) {
  write(at("scene.toml"), on_a_floor(3, 60));
  std::string grains = "id,x,y,z,radius,vx,vy,vz\n";
  for (int k = 0; k < 96; ++k)
    grains += fmt::format("{},{},{},{},0.01,{},0,0\n", k, 0.0201 * (k % 8) + (k % 8 < 5 ? 0 : 0.06),
                          0.0201 * (k / 8 % 4), 0.0101 + 0.0201 * (k / 32), k % 8 < 5 ? 0 : -2);
  write(at("grains.csv"), grains);
  const std::string keys =
      "run scene.toml --force --threads 1 --set allow_unconverged=true --set decomposition.exchange=ccs "
      "--set "
      "decomposition.partitioner=boxes --set decomposition.boxes=[3,1,1]";
  const Outcome one = run(1, keys + " --out one");
  ASSERT_EQ(one.code, 0) << one.messages;
  const Outcome several = run(3, keys + " --out several");
  ASSERT_EQ(several.code, 0) << several.messages;
  EXPECT_EQ(digest_of("several"), digest_of("one"));
}

TEST_F(Ranks, BearAPileInOneCornerAndABoulderLargerThanSubdomains) {
  write(at("scene.toml"), on_a_floor(30, 25));
  std::string grains = "id,x,y,z,radius\n";
  for (int k = 0; k < 27; ++k)
    grains += fmt::format("{},{},{},{},0.01\n", k, 0.0201 * (k % 3), 0.0201 * (k / 3 % 3),
                          0.0101 + 0.0201 * (k / 9));
  grains += "100,0.02,0.02,0.37,0.3\n101,5,5,0.0101,0.01\n";
  write(at("grains.csv"), grains);
  for (const std::string coupling : {"nscdd", "alternating", "schwarz"}) {
    const std::string keys =
        "run scene.toml --force --threads 1 --set allow_unconverged=true --set decomposition.coupling=" +
        coupling;
    const Outcome one = run(1, keys + " --out one");
    ASSERT_EQ(one.code, 0) << one.messages;
    for (const std::string mapping : {"block", "cyclic"}) {
      const Outcome several = run(3, keys + " --out several --set decomposition.mapping=" + mapping);
      ASSERT_EQ(several.code, 0) << several.messages;
      EXPECT_EQ(digest_of("several"), digest_of("one")) << coupling << ", " << mapping;
    }
  }
}

}  // namespace
}  // namespace talus::test
