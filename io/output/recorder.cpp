#include "io/output/recorder.hpp"

#include <algorithm>
#include <utility>

#include "io/output/sinks.hpp"
#include "io/results/results.hpp"

namespace talus::io {
namespace {

void drop_contacts(Frame& frame) {
  frame.contact_bodies.clear();
  frame.contact_point.clear();
  frame.contact_normal.clear();
  frame.contact_gap.clear();
  frame.contact_force.clear();
  frame.contact_moment.clear();
  frame.with_contacts = false;
}

}  // namespace

OutputContext output_context(const std::filesystem::path& directory, const Setup& setup,
                             const graph::Communicator& ranks) {
  OutputContext context{
      .directory = directory, .walls = setup.walls, .material_names = setup.material_names, .ranks = ranks};
  for (const FieldRule& field : setup.fields) context.grids.push_back(field.name);
  context.periodic = setup.domain.repeats;
  context.clumps = setup.clumps;
  context.inserts = !setup.inserts.empty();
  for (const Stage& stage : setup.stages) context.axis_of_stage.emplace(stage.name, stage.end.strain_axis);
  for (const Wall& wall : setup.walls)
    context.load.pressure = std::max(context.load.pressure, wall.load.pressure);
  for (const Stage& stage : setup.stages)
    for (const auto& [wall, load] : stage.loads)
      context.load.pressure = std::max(context.load.pressure, load.pressure);
  return context;
}

Recorder::Recorder(OutputContext context, const std::set<std::string>& names) : context_(std::move(context)) {
  for (const auto& sink : sink_registry())
    if (sink.make->use == SinkUse::always || names.contains(std::string(sink.name)))
      sinks_.push_back(sink.make->make(context_));
}

void Recorder::open() {
  for (const auto& sink : sinks_) sink->open();
}

void Recorder::resume(const OutputMark& mark) {
  frame_times_ = mark.frame_times;
  for (const auto& sink : sinks_) sink->resume(mark);
}

OutputMark Recorder::mark() {
  OutputMark mark{.frame_times = frame_times_};
  if (context_.ranks.rank() != 0) return mark;
  flush();
  for (const auto& sink : sinks_) sink->mark(mark);
  return mark;
}

void Recorder::record_step(const StepRecord& record) {
  if (context_.ranks.rank() != 0) return;
  for (const auto& sink : sinks_) sink->step(record);
}

void Recorder::flush() {
  if (context_.ranks.rank() != 0) return;
  for (const auto& sink : sinks_) sink->flush();
}

void Recorder::record_frame(Frame&& frame) {
  const Frame state = [&] {
    Frame taken = std::move(frame);
    if (!context_.contacts) drop_contacts(taken);
    return taken;
  }();
  validate(state);
  for (const auto& sink : sinks_) sink->frame(state);
  frame_times_.push_back(state.time);
}

void Recorder::close() {
  if (context_.ranks.rank() != 0) return;
  for (const auto& sink : sinks_) sink->close();
}

void Recorder::end(const Summary& summary) {
  if (context_.ranks.rank() != 0) return;
  for (const auto& sink : sinks_) sink->end(summary);
}

}  // namespace talus::io
