// results.h5 and the files for ParaView.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>

#include "io/files/error.hpp"
#include "io/results/results.hpp"
#include "io/results/vtk.hpp"
#include "runtime/graph/one_rank.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io {
namespace {

namespace fs = std::filesystem;
using namespace talus::test;

/// Equal bits, not equal values: -0.0 is not 0.0.
template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_same(const Frame& a, const Frame& b) {
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.stage, b.stage);
  EXPECT_TRUE(same_bits(a.id, b.id));
  EXPECT_TRUE(same_bits(a.x, b.x));
  EXPECT_TRUE(same_bits(a.radius, b.radius));
  EXPECT_TRUE(same_bits(a.u, b.u));
  EXPECT_TRUE(same_bits(a.omega, b.omega));
  EXPECT_TRUE(same_bits(a.orientation, b.orientation));
  EXPECT_TRUE(same_bits(a.contact_bodies, b.contact_bodies));
  EXPECT_TRUE(same_bits(a.contact_point, b.contact_point));
  EXPECT_TRUE(same_bits(a.contact_normal, b.contact_normal));
  EXPECT_TRUE(same_bits(a.contact_gap, b.contact_gap));
  EXPECT_TRUE(same_bits(a.contact_force, b.contact_force));
  EXPECT_TRUE(same_bits(a.contact_moment, b.contact_moment));
  ASSERT_EQ(a.walls.size(), b.walls.size());
  for (std::size_t k = 0; k < a.walls.size(); ++k) {
    EXPECT_EQ(a.walls[k].name, b.walls[k].name);
    EXPECT_EQ(a.walls[k].position, b.walls[k].position);
    EXPECT_EQ(a.walls[k].velocity, b.walls[k].velocity);
    EXPECT_EQ(a.walls[k].force, b.walls[k].force);
    EXPECT_EQ(a.walls[k].normal, b.walls[k].normal);
    EXPECT_EQ(a.walls[k].absent, b.walls[k].absent);
    EXPECT_EQ(a.walls[k].pose.moved, b.walls[k].pose.moved);
    EXPECT_EQ(a.walls[k].pose.turn, b.walls[k].pose.turn);
    EXPECT_EQ(a.walls[k].pose.shift, b.walls[k].pose.shift);
  }
}

/// Grains and contacts enough for several chunks.
Frame many_grains() {
  Frame frame = three_grains();
  const std::size_t n = 40000;
  frame.omega.clear();
  frame.orientation.clear();
  frame.material.clear();
  frame.id.resize(n);
  frame.x.resize(n);
  frame.radius.assign(n, 0.01);
  frame.u.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const double t = 0.1 * static_cast<double>(k);
    frame.id[k] = static_cast<std::int64_t>(k);
    frame.x[k] = {std::sin(t), std::cos(t), t};
    frame.u[k] = {t, 1 / (1 + t), -t};
  }
  return frame;
}

TEST(Results, CompressedReadBackBitForBit) {
  const ScratchDirectory scratch;
  const Frame frame = many_grains();
  ResultsWriter plain(scratch / "plain.h5", {"bottom", "left"});
  ResultsWriter small(scratch / "small.h5", {"bottom", "left"}, graph::one_rank(), {.compression = 3});
  for (int k = 0; k < 2; ++k) {
    plain.append(frame);
    small.append(frame);
    expect_same(read_frame(scratch / "small.h5", static_cast<std::size_t>(k)), frame);
  }
  EXPECT_LT(fs::file_size(scratch / "small.h5"), fs::file_size(scratch / "plain.h5") * 8 / 10);
}

TEST(Results, InSinglePrecisionAreTheNearestFloats) {
  const ScratchDirectory scratch;
  const Frame frame = many_grains();
  for (const int compression : {0, 1}) {
    ResultsWriter writer(scratch / "results.h5", {"bottom", "left"}, graph::one_rank(),
                         {.precision = FrameFormat::Precision::single, .compression = compression});
    writer.append(frame);
    const Frame read = read_frame(scratch / "results.h5", 0);
    EXPECT_EQ(read.id, frame.id);
    ASSERT_EQ(read.x.size(), frame.x.size());
    for (std::size_t k = 0; k < frame.x.size(); ++k)
      for (int axis = 0; axis < 3; ++axis)
        ASSERT_EQ(read.x[k][axis], static_cast<double>(static_cast<float>(frame.x[k][axis]))) << k;
    EXPECT_EQ(read.walls[0].position, frame.walls[0].position) << "walls stay in full";
    EXPECT_LT(fs::file_size(scratch / "results.h5"), 40000U * (8 + 4 * 7) + 60000U);
  }
}

TEST(Results, ContactsThatAreNotAskedForAreNotRead) {
  const ScratchDirectory scratch;
  ResultsWriter(scratch / "flat.h5", {"bottom", "left"}, graph::one_rank(), {.contact_geometry = false})
      .append(three_grains());
  Frame expected = three_grains();
  expected.contact_bodies.clear();
  expected.contact_point.clear();
  expected.contact_normal.clear();
  expected.contact_gap.clear();
  expected.contact_force.clear();
  expect_same(read_frame(scratch / "flat.h5", 0, FrameParts::without_contacts), expected);
}

TEST(Results, WithoutVelocitiesOrGeometrySayWhatIsMissing) {
  const ScratchDirectory scratch;
  ResultsWriter(scratch / "still.h5", {"bottom", "left"}, graph::one_rank(), {.velocities = false})
      .append(three_grains());
  EXPECT_NE(message_of<FileError>([&] {
              read_frame(scratch / "still.h5", 0);
            }).find("has no bodies/u: run the scene with output.velocities = true"),
            std::string::npos);
  EXPECT_EQ(read_frame(scratch / "still.h5", 0, FrameParts::places).x, three_grains().x);
  ResultsWriter(scratch / "flat.h5", {"bottom", "left"}, graph::one_rank(), {.contact_geometry = false})
      .append(three_grains());
  EXPECT_NE(message_of<FileError>([&] {
              read_frame(scratch / "flat.h5", 0);
            }).find("has no contacts/point: run the scene with output.contact_geometry = true"),
            std::string::npos);
}

TEST(Results, ReadBackBitForBit) {
  const ScratchDirectory scratch;
  ResultsWriter writer(scratch / "results.h5", {"bottom", "left"});
  EXPECT_EQ(frame_count(scratch / "results.h5"), 0u);
  writer.append(three_grains());

  Frame bare = three_grains();  // as a frictionless scene leaves it before the first contact
  bare.omega.clear();
  bare.contact_bodies.clear();
  bare.contact_point.clear();
  bare.contact_normal.clear();
  bare.contact_gap.clear();
  bare.contact_force.clear();
  bare.stage = "compaction isotrope, 1\u02b3\u1d49";
  writer.append(bare);

  Frame turned = three_grains();
  turned.orientation = {{1, 0, 0, 0}, {0.5, 0.5, 0.5, 0.5}, {0, -0.0, 0, 1}};
  writer.append(turned);

  ASSERT_EQ(frame_count(scratch / "results.h5"), 3u);
  expect_same(read_frame(scratch / "results.h5", 0), three_grains());
  expect_same(read_frame(scratch / "results.h5", 1), bare);
  expect_same(read_frame(scratch / "results.h5", 2), turned);
}

TEST(Results, HoldMomentsWhereContactsResistRolling) {
  const ScratchDirectory scratch;
  Frame frame = three_grains();
  ResultsWriter writer(scratch / "results.h5", {"bottom", "left"});
  writer.append(frame);
  frame.contact_moment = {Vec3(1e-300, -0.0, 3), Vec3(0, 1.0 / 3, 0)};
  writer.append(frame);
  EXPECT_TRUE(read_frame(scratch / "results.h5", 0).contact_moment.empty());
  expect_same(read_frame(scratch / "results.h5", 1), frame);
  frame.contact_moment.pop_back();
  EXPECT_EQ(message_of<std::invalid_argument>([&] { writer.append(frame); }),
            "frame: contact_moment has 1 entries, expected 2");
}

TEST(Results, HoldTheCellOfEachFrame) {
  const ScratchDirectory scratch;
  ResultsWriter writer(scratch / "results.h5", {"bottom", "left"});
  Frame frame = three_grains();
  frame.domain = periodic_domain({1.0 / 3, 0, 0.7}, {-1, 0, 2}, {0, 0.1, 0});
  frame.domain.rates = {.xx = -0.1, .xz = 3};
  writer.append(frame);
  writer.append(three_grains());
  const Domain read = read_frame(scratch / "results.h5", 0).domain;
  EXPECT_EQ(read.edges(), frame.domain.edges());
  EXPECT_EQ(read.low, frame.domain.low);
  EXPECT_EQ(read.cell.xz, 0.1);
  EXPECT_EQ(read.rates.xx, -0.1);
  EXPECT_EQ(read.rates.xz, 3);
  EXPECT_TRUE(read.flows);
  EXPECT_FALSE(read_frame(scratch / "results.h5", 1).domain.repeats) << "between walls";
}

TEST(Results, HoldASampleWithoutBodiesAndWalls) {
  const ScratchDirectory scratch;
  ResultsWriter writer(scratch / "results.h5", {});
  writer.append(Frame{});
  expect_same(read_frame(scratch / "results.h5", 0), Frame{});
}

TEST(Results, CanBeReadAfterEveryFrameAsAKilledRunLeavesThem) {
  const ScratchDirectory scratch;
  ResultsWriter writer(scratch / "results.h5", {"bottom", "left"});
  for (std::size_t k = 1; k <= 3; ++k) {
    writer.append(three_grains());
    fs::copy_file(scratch / "results.h5", scratch / "as-killed.h5", fs::copy_options::overwrite_existing);
    EXPECT_EQ(frame_count(scratch / "as-killed.h5"), k);
    expect_same(read_frame(scratch / "as-killed.h5", k - 1), three_grains());
  }
}

TEST(Results, RefuseAFrameWhoseArraysDoNotFit) {
  const ScratchDirectory scratch;
  ResultsWriter writer(scratch / "results.h5", {"bottom", "left"});
  Frame frame = three_grains();
  frame.contact_gap.pop_back();
  EXPECT_EQ(message_of<std::invalid_argument>([&] { writer.append(frame); }),
            "frame: contact_gap has 1 entries, expected 2");
  frame = three_grains();
  frame.walls[1].name = "right";
  EXPECT_EQ(message_of<std::invalid_argument>([&] { writer.append(frame); }),
            "frame: wall 1 is 'right', expected 'left'");
  EXPECT_EQ(frame_count(scratch / "results.h5"), 0u);
}

TEST(Results, KeepTheFramesBeforeTheDiskWasFull) {
  const ScratchDirectory scratch;
  ResultsWriter writer(scratch / "results.h5", {"bottom", "left"});
  writer.append(three_grains());
  Frame large = three_grains();
  large.id.resize(100000);
  large.x.resize(100000);
  large.radius.resize(100000);
  large.u.resize(100000);
  large.omega.resize(100000);
  std::string message;
  {
    const FileSizeLimit limit(100000);
    message = message_of<FileError>([&] { writer.append(large); });
  }
  EXPECT_NE(message.find((scratch / "results.h5").string()), std::string::npos) << message;
  EXPECT_EQ(writer.frames_written(), 1u);
  ASSERT_EQ(frame_count(scratch / "results.h5"), 1u);
  expect_same(read_frame(scratch / "results.h5", 0), three_grains());
}

TEST(Results, ErrorsNameTheFile) {
  const ScratchDirectory scratch;
  const auto names = [](const std::string& message, const fs::path& path) {
    return message.find(path.string()) != std::string::npos;
  };
  EXPECT_PRED2(names, message_of<FileError>([&] { ResultsWriter(scratch / "no/results.h5", {}); }),
               scratch / "no/results.h5");
  EXPECT_PRED2(names, message_of<FileError>([&] { read_frame(scratch / "none.h5", 0); }),
               scratch / "none.h5");
  std::ofstream(scratch / "text.h5") << "not HDF5";
  EXPECT_PRED2(names, message_of<FileError>([&] { frame_count(scratch / "text.h5"); }), scratch / "text.h5");
  ResultsWriter writer(scratch / "results.h5", {});
  EXPECT_PRED2(names, message_of<FileError>([&] { read_frame(scratch / "results.h5", 0); }),
               scratch / "results.h5");
}

TEST(Vtk, GrainsKeepTheirValues) {
  const Frame frame = three_grains();
  const std::string text = grains_vtp(frame);
  EXPECT_TRUE(well_formed(text));
  EXPECT_EQ(occurrences(text, "NumberOfPoints=\"3\" NumberOfVerts=\"3\" NumberOfLines=\"0\""), 1u);
  EXPECT_EQ(array_of<std::int64_t>(text, "id"), frame.id);
  EXPECT_EQ(array_of<float>(text, "radius"), (std::vector<float>{0.1f, 0.11f, static_cast<float>(0.1 / 3)}));
  EXPECT_EQ(array_of<float>(text, "Points").at(3), 0.3f);
  EXPECT_EQ(array_of<float>(text, "velocity").at(5), 6.0f);
  EXPECT_EQ(array_of<float>(text, "omega").size(), 9u);
  EXPECT_EQ(array_of<std::int64_t>(text, "offsets"), (std::vector<std::int64_t>{1, 2, 3}));
  EXPECT_EQ(occurrences(text, "orientation"), 0u);
}

TEST(Vtk, ForcesRunBetweenCentresAndToTheWall) {
  const std::string text = forces_vtp(three_grains());
  EXPECT_TRUE(well_formed(text));
  EXPECT_EQ(occurrences(text, "NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"2\""), 1u);
  const auto points = array_of<float>(text, "Points");
  ASSERT_EQ(points.size(), 12u);
  EXPECT_EQ(points[0], 0.1f);   // grain 7
  EXPECT_EQ(points[3], 0.3f);   // grain 3
  EXPECT_EQ(points[11], 0.0f);  // on the floor
  EXPECT_EQ(array_of<float>(text, "normal_force"), (std::vector<float>{2.5f, 2.5f, 1.25f, 1.25f}));
  EXPECT_EQ(array_of<std::int64_t>(text, "wall"), (std::vector<std::int64_t>{-1, 0}));
  EXPECT_EQ(array_of<std::int64_t>(text, "offsets"), (std::vector<std::int64_t>{2, 4}));
}

TEST(Vtk, ForcesOfManyContactsAreAllThere) {
  // More numbers than are made, and bytes than are encoded, at a time.
  Frame frame = three_grains();
  constexpr std::size_t contacts = 70'001;
  const std::array<std::int64_t, 2> bodies = frame.contact_bodies[0];
  frame.contact_bodies.assign(contacts, bodies);
  frame.contact_normal.assign(contacts, Vec3::UnitX());
  frame.contact_point.assign(contacts, Vec3::Zero());
  frame.contact_gap.assign(contacts, 0);
  frame.contact_force.resize(contacts);
  for (std::size_t k = 0; k < contacts; ++k) frame.contact_force[k] = Vec3(static_cast<double>(k), 0, -1);
  const std::string text = forces_vtp(frame);
  const auto force = array_of<float>(text, "force"), normal = array_of<float>(text, "normal_force");
  ASSERT_EQ(force.size(), 3 * contacts);
  ASSERT_EQ(normal.size(), 2 * contacts);
  for (std::size_t k = 0; k < contacts; ++k) {
    ASSERT_EQ(force[3 * k], static_cast<float>(k));
    ASSERT_EQ(force[3 * k + 2], -1.0f);
    ASSERT_EQ(normal[2 * k + 1], static_cast<float>(k));
  }
  EXPECT_EQ(array_of<float>(text, "Points").size(), 6 * contacts);
}

TEST(Vtk, GrainsTakeFieldsOfTheirOwnAndRefuseThoseThatDoNotFit) {
  const std::vector<std::int32_t> subdomain{4, -1, 2}, two{1, 2};
  const GrainField good{"subdomain", subdomain}, bad{"multiplicity", two};
  const std::string text = grains_vtp(three_grains(), std::span(&good, 1));
  EXPECT_TRUE(well_formed(text));
  EXPECT_EQ(array_of<std::int32_t>(text, "subdomain"), subdomain);
  EXPECT_EQ(array_of<std::int64_t>(text, "id"), three_grains().id);
  EXPECT_EQ(message_of<std::invalid_argument>([&] { grains_vtp(three_grains(), std::span(&bad, 1)); }),
            "frame: field 'multiplicity' has 2 values for 3 bodies");
}

TEST(Vtk, AFrameWithoutAnythingIsStillAFile) {
  EXPECT_TRUE(well_formed(grains_vtp(Frame{})));
  EXPECT_TRUE(well_formed(forces_vtp(Frame{})));
  EXPECT_TRUE(array_of<float>(grains_vtp(Frame{}), "radius").empty());
}

TEST(Results, TellWhereWallsAreAndOfWhatMaterial) {
  const ScratchDirectory scratch;
  Frame frame = three_grains();
  frame.walls[0].normal = Vec3(0, 0.6, 0.8);
  frame.walls[0].absent = true;
  frame.walls[1].pose = {Mat3(Eigen::AngleAxisd(0.3, Vec3(1, 2, 2) / 3)), Vec3(0.1, -0.2, 1.0 / 3), true};
  ResultsNames names({"bottom", "left"});
  names.wall_materials = {1, 0};
  names.materials = {"sand", "steel"};
  ResultsWriter writer(scratch / "results.h5", names);
  writer.append(three_grains());
  writer.append(frame);
  expect_same(read_frame(scratch / "results.h5", 0), three_grains());
  expect_same(read_frame(scratch / "results.h5", 1), frame);
}

TEST(Vtk, AContactOfAnUnknownBodyIsNamed) {
  Frame frame = three_grains();
  frame.contact_bodies[0] = {7, 99};
  EXPECT_NE(message_of<std::invalid_argument>([&] { forces_vtp(frame); }).find("body 99"), std::string::npos);
}

TEST(Vtk, CollectionGivesEveryFileItsTime) {
  const std::string text = collection_pvd({{0, 0, "a.vtp"}, {0.1, 1, "b.vtp"}});
  EXPECT_TRUE(well_formed(text));
  EXPECT_EQ(occurrences(text, "<DataSet timestep=\"0.1\" part=\"1\" file=\"b.vtp\"/>"), 1u);
}

}  // namespace
}  // namespace talus::io
