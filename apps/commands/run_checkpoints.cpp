#include "apps/commands/run_checkpoints.hpp"

#include <fmt/format.h>

#include <exception>
#include <fstream>
#include <iterator>
#include <utility>

#include "io/checkpoint/checkpoint_folder.hpp"
#include "io/checkpoint/number_text.hpp"
#include "io/files/error.hpp"
#include "io/scene/scene_change.hpp"
#include "runtime/graph/clock.hpp"

namespace talus {

namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw io::FileError(path, "cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// visit(name, number) for each number that outlives a stop. The step of the deepest overlap is told by its
/// number, its depth and its pair.
template <class Memory, class Visit>
void each_number_of(Memory& memory, const Visit& visit) {
  auto& tally = memory.tally;
  visit("unconverged", tally.unconverged);
  visit("passed", tally.passed);
  visit("stagnated", tally.stagnated);
  visit("floor", tally.floor);
  visit("iterations", tally.iterations);
  visit("worst_error", tally.worst_error);
  visit("worst_balance", tally.worst_balance);
  visit("worst_velocity", tally.worst_velocity);
  visit("worst_penetration", tally.worst_penetration);
  visit("worst_overlap", tally.worst_overlap);
  visit("last_overlap", tally.last_overlap);
  visit("overlapped", tally.overlapped);
  visit("deepest_step", tally.deepest.step);
  visit("deepest_overlap", tally.deepest.overlap);
  visit("furthest_step", tally.furthest.step);
  visit("furthest_contact_error", tally.furthest.worst.contact_error);
  visit("furthest_body_error", tally.furthest.worst.body_error);
  visit("furthest_body", tally.furthest.worst.body);
  visit("sufficient_time_step", tally.sufficient_time_step);
  visit("exposed", tally.exposed);
  visit("iterating", tally.iterating);
  visit("frames_passed", memory.frames_passed);
  visit("saves_passed", memory.saves_passed);
  visit("saved", memory.saved);
  visit("wall_s", memory.wall_s);
  visit("wall_points", memory.wall_points);
  visit("wall_mass", memory.wall_mass);
  visit("named", memory.named);
  visit("frame_times", memory.mark.frame_times);
}

}  // namespace

std::string text_of(const RunMemory& memory) {
  const io::NumberWriter write;
  each_number_of(memory, write);
  write("jammed", memory.tally.jammed);
  write("locked", memory.tally.locked);
  write("unanswered", memory.tally.unanswered);
  const BodyPair deepest = memory.tally.deepest.overlapping.value_or(BodyPair{});
  write("deepest_pair", std::vector<std::int64_t>{deepest.body, deepest.with});
  const BodyPair& furthest = memory.tally.furthest.worst.contact;
  write("furthest_pair", std::vector<std::int64_t>{furthest.body, furthest.with});
  std::vector<std::string> files;
  std::vector<std::int64_t> bytes, crcs;
  for (const auto& [file, mark] : memory.mark.files) {
    files.push_back(file);
    bytes.push_back(mark.bytes);
    crcs.push_back(mark.crc);
  }
  write("files", files);
  write("bytes", bytes);
  write("crcs", crcs);
  return write.text();
}

RunMemory read_memory(const std::string& text, const std::string& file) {
  const io::NumberReader read(text, file);
  RunMemory memory;
  each_number_of(memory, read);
  read("jammed", memory.tally.jammed);
  if (read.has("locked")) read("locked", memory.tally.locked);              // since 30 November 2026
  if (read.has("unanswered")) read("unanswered", memory.tally.unanswered);  // since 28 November 2026
  std::vector<std::int64_t> deepest, furthest, bytes, crcs;
  std::vector<std::string> files;
  read("deepest_pair", deepest);
  read("furthest_pair", furthest);
  read("files", files);
  read("bytes", bytes);
  read("crcs", crcs);
  if (deepest.size() != 2 || furthest.size() != 2 || files.size() != bytes.size() ||
      files.size() != crcs.size())
    throw io::FileError(file, "is damaged");
  if (deepest[0] >= 0) memory.tally.deepest.overlapping = BodyPair{deepest[0], deepest[1]};
  memory.tally.furthest.worst.contact = {furthest[0], furthest[1]};
  for (std::size_t k = 0; k < files.size(); ++k)
    memory.mark.files[files[k]] = {bytes[k], static_cast<std::uint32_t>(crcs[k])};
  return memory;
}

std::map<std::string, std::string> texts_of(const io::Scene& scene, const std::string& resolved,
                                            const std::vector<std::string>& overrides) {
  std::map<std::string, std::string> texts;
  texts["scene.toml"] = content_of(scene.source_file);
  texts[resolved_text] = resolved;
  std::string& given = texts["overrides"];
  for (const std::string& override : overrides) given += override + '\n';
  for (const std::string& file : io::input_files(scene)) texts[input_prefix + file] = content_of(file);
  return texts;
}

CheckpointKeeper::CheckpointKeeper(const io::CheckpointSpec& spec, std::filesystem::path directory,
                                   std::map<std::string, std::string> texts, const graph::Communicator& ranks,
                                   const Terminal& terminal)
    : spec_(spec),
      directory_(std::move(directory)),
      texts_(std::move(texts)),
      ranks_(ranks),
      terminal_(terminal),
      due_(spec.every_steps, spec.every) {}

void CheckpointKeeper::start(const RunMemory& memory) {
  due_ = DueClock(spec_.every_steps, spec_.every, memory.saves_passed);
  saved_ = memory.saved;
  last_save_ = graph::seconds_now();
}

bool CheckpointKeeper::save(const Simulation& simulation, RunMemory memory, bool counts) {
  const double began = graph::seconds_now();
  const std::int64_t step = simulation.report().step;
  memory.saves_passed = due_.passed();
  memory.saved = saved_ + (counts ? 1 : 0);
  const bool archived = counts && spec_.archive_every && memory.saved % *spec_.archive_every == 0;
  bool written = true;
  io::CheckpointFile file{simulation.checkpoint(), text_of(memory), std::move(texts_)};
  try {
    io::write_checkpoint(directory_ / io::checkpoint_name(step, archived), file, ranks_);
  } catch (const std::exception& error) {
    written = false;
    if (ranks_.rank() == 0) terminal_.warn("warning: no checkpoint behind step {}: {}", step, error.what());
  }
  texts_ = std::move(file.texts);
  last_save_ = graph::seconds_now();
  seconds_ = last_save_ - began;
  if (!written) return false;
  saved_ = memory.saved;
  last_step_ = step;
  if (ranks_.rank() == 0) io::remove_old_checkpoints(directory_, spec_.keep);
  return true;
}

}  // namespace talus
