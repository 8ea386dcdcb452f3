#include "apps/commands/partition_command.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/placed_sample.hpp"
#include "apps/shared/print.hpp"
#include "io/files/output_directory.hpp"
#include "io/pictures/picture.hpp"
#include "io/results/vtk.hpp"
#include "io/scene/scene.hpp"
#include "io/scene/scene_change.hpp"
#include "kernels/detection/images.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "partition/interface.hpp"
#include "partition/load_table.hpp"
#include "partition/partitioners.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/step/decomposition.hpp"

namespace talus {

namespace {

struct ContactPairs {
  double alert = 0;  ///< [m] pairs with a smaller gap
  std::vector<GrainPair> grains;
  std::vector<WallPair> walls;
};

/// The contacts that a first step of the sample at rest would have: the step's candidates without the skin
/// that spares it later broad phases, since Table 4 counts contacts.
ContactPairs find_contacts(const io::Scene& scene, const Bodies& bodies, int threads) {
  ContactPairs contacts;
  const double smallest = *std::min_element(bodies.radius.begin(), bodies.radius.end());
  contacts.alert = alert_distance(scene.setup.detection, smallest);
  std::vector<double> reach;
  for (double radius : bodies.radius) reach.push_back(radius + 0.5 * contacts.alert);

  const std::vector<double> margin(scene.setup.walls.size(), contacts.alert);
  contacts.walls = find_wall_pairs(bodies.x, bodies.radius, scene.setup.walls, margin);
  if (scene.setup.domain.repeats) {
    contacts.grains = near_pairs(scene.setup.domain, bodies.x, reach);
    return contacts;
  }
  const CellGrid cells = build_cells(bodies.x, reach);
  const auto shares = static_cast<std::size_t>(threads);
  std::vector<std::vector<GrainPair>> parts(shares);
  graph::Executor executor({.threads = threads});
  graph::Graph detection;
  for (std::size_t share = 0; share < shares; ++share)
    detection.task("find pairs", {}, [&, share] {
      find_pairs(cells, cells.cells.size() * share / shares, cells.cells.size() * (share + 1) / shares,
                 parts[share]);
    });
  executor.run(detection);
  contacts.grains = sort_pairs(parts, bodies.size());
  return contacts;
}

struct Cut {
  PartitionKind kind;
  Partition partition;
  std::vector<std::int32_t> home;          ///< per grain: subdomain of its centre
  std::vector<std::int32_t> multiplicity;  ///< per grain
  LoadTable load;
};

Cut cut_sample(const PartitionOptions& options, const Bodies& bodies, const ContactPairs& contacts,
               std::size_t walls, const PartitionPoints& points) {
  Cut cut{options.kind, make_partition(points, options), {}, {}, {}};
  const std::vector<SubdomainId> subdomain = subdomains_of(cut.partition, points.x),
                                 home = subdomains_of(cut.partition, bodies.x);
  for (const SubdomainId at_centre : home) cut.home.push_back(at_centre.value());
  const BodySubdomains grains =
      grain_subdomains(bodies.size(), contacts.grains, contacts.walls, subdomain, home);
  const BodySubdomains of_walls =
      wall_subdomains(walls, contacts.walls, std::span(subdomain).subspan(contacts.grains.size()));
  for (std::size_t body = 0; body < bodies.size(); ++body)
    cut.multiplicity.push_back(grains.multiplicity(body));
  const FirstNumbers<SubdomainId> numbers(static_cast<std::size_t>(options.subdomains));
  const std::vector<SubdomainId> all(numbers.begin(), numbers.end());
  cut.load =
      measure_load(options.subdomains, build_interfaces(grains, bodies.id, all), grains, of_walls, subdomain);
  return cut;
}

/// Throws std::invalid_argument when the scene's boxes are not the subdomains asked for, and one of the
/// `kinds` cuts boxes.
void check_boxes(const DecompositionSettings& settings, std::int32_t subdomains,
                 std::span<const PartitionKind> kinds) {
  if (std::ranges::any_of(kinds, cuts_boxes) && settings.boxes[0] > 0 && settings.subdomains != subdomains)
    throw std::invalid_argument(
        fmt::format("--subdomains {}, but the scene's decomposition.boxes are {}: change them "
                    "with --set 'decomposition.boxes=[X, Y, Z]'",
                    subdomains, settings.subdomains));
}

std::vector<PartitionKind> kinds_of(const std::vector<std::string>& names) {
  std::vector<PartitionKind> kinds;
  for (const std::string& name : names) {
    const PartitionKind kind = partition_kind(name);
    if (std::ranges::find(kinds, kind) == kinds.end()) kinds.push_back(kind);
  }
  if (!kinds.empty()) return kinds;
  for (const auto& partitioner : partitioner_registry())
    if (partitioner.kind != PartitionKind::automatic) kinds.push_back(partitioner.kind);
  return kinds;
}

Frame frame_of(const Bodies& bodies) {
  Frame frame;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    frame.id.push_back(static_cast<std::int64_t>(bodies.id[k]));
    frame.u.push_back(Eigen::Map<const Vec3>(bodies.velocity[k].u));
  }
  frame.x = bodies.x;
  frame.radius = bodies.radius;
  return frame;
}

void print_table(const io::Scene& scene, std::size_t grains, const ContactPairs& contacts,
                 std::span<const Cut> cuts) {
  print_out("{}: {} grains, {} contacts ({} at walls; gap below {:.4g} m), {} subdomains\n\n", scene.name,
            grains, contacts.grains.size() + contacts.walls.size(), contacts.walls.size(), contacts.alert,
            cuts.front().partition.subdomains);
  std::vector<std::string_view> names;
  std::vector<LoadTable> tables;
  for (const Cut& cut : cuts) {
    names.push_back(name_of(cut.kind));
    tables.push_back(cut.load);
  }
  print_out("{}", load_text(names, tables));
  for (const Cut& cut : cuts)
    if (cut.kind == PartitionKind::automatic) print_out("\nauto is {}\n", name_of(cut.partition.kind));
}

/// Whether `name` is one that write_files gives to a file.
bool is_partition_name(const std::string& name) {
  return std::ranges::any_of(partitioner_registry(), [&](const auto& partitioner) {
    const std::string stem = "partition_" + std::string(partitioner.name);
    return name == stem + ".vtp" || name == stem + ".svg";
  });
}

void write_files(const std::string& directory, const io::Scene& scene, const Bodies& bodies,
                 std::span<const Cut> cuts) {
  const Frame frame = frame_of(bodies);
  for (const Cut& cut : cuts) {
    const std::string stem = fmt::format("{}/partition_{}", directory, name_of(cut.kind));
    const std::array<io::GrainField, 2> fields{{{"subdomain", cut.home}, {"multiplicity", cut.multiplicity}}};
    io::write_whole(stem + ".vtp", io::grains_vtp(frame, fields));
    const io::PartitionPicture picture{
        .title = fmt::format("{}, partitioner \u201c{}\u201d", scene.name, name_of(cut.kind)),
        .subdomains = cut.partition.subdomains};
    io::write_whole(stem + ".svg", io::draw_partition(frame, cut.home, cut.multiplicity, picture));
  }
}

}  // namespace

int partition_command(const PartitionCommandOptions& options) {
  io::Scene scene;
  Bodies bodies;
  std::vector<PartitionKind> kinds;
  std::string directory = options.out;
  std::optional<io::DirectoryLock> lock;
  try {
    kinds = kinds_of(options.partitioners);
    scene = io::load_scene(options.scene, options.overrides);
    const Sample sample = place_sample(scene).sample;
    append(sample, bodies);
    if (bodies.size() == 0)
      throw io::error_in(
          scene, "",
          "no grain is there at the beginning, all are inserted: there is nothing to cut. Take "
          "a frame of a run of it as a sample ([sample] kind = \"state\")");
    if (directory.empty()) directory = "out/partition-" + scene.name;
    check_boxes(scene.setup.decomposition, options.subdomains, kinds);
    lock.emplace(
        io::prepare_output_directory(directory, options.force, is_partition_name, io::files_read(scene)));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    const int threads = options.threads > 0 ? options.threads : omp_get_num_procs();
    const ContactPairs contacts = find_contacts(scene, bodies, threads);
    const PartitionPoints points =
        candidate_points(bodies.x, contacts.grains, contacts.walls, scene.setup.domain);
    if (points.x.empty())
      print_error("talus: warning: no grain touches another: there are no contacts to share out\n");
    std::vector<Cut> cuts;
    PartitionOptions cutting = partition_options(scene.setup.decomposition, options.subdomains);
    cutting.domain = scene.setup.domain;
    for (const PartitionKind kind : kinds) {
      cutting.kind = kind;
      cuts.push_back(cut_sample(cutting, bodies, contacts, scene.setup.walls.size(), points));
    }
    print_table(scene, bodies.size(), contacts, cuts);
    write_files(directory, scene, bodies, cuts);
    print_error("talus: .vtp and .svg files in {}\n", directory);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
  return exit_done;
}

}  // namespace talus
