#include "kernels/global/step_reader.hpp"

#include "kernels/detection/materials.hpp"
#include "kernels/detection/measures.hpp"

namespace talus {

namespace {

BodyUnknown unknown_of_wall(const WallMotion& wall) {
  BodyUnknown body;
  body.mass = 1 / wall.inv_mass;
  body.kind = BodyKind::wall;
  body.axis = wall.normal;
  body.free.u = wall.normal.dot(wall.free_velocity) * wall.normal;
  return body;
}

BodyUnknown unknown_of_cell(const CellMotion& cell) {
  BodyUnknown body;
  body.mass = body.spin_mass = cell.mass;
  body.radius = cell.edge;
  body.axis = cell.stretches;
  body.shears = cell.shears;
  body.kind = BodyKind::cell;
  return body;
}

}  // namespace

StepReader::StepReader(const BodyProblemSource& source, std::optional<BodyProblemPart> part)
    : source_(source),
      part_(part),
      begin_(part ? part->begin : 0),
      end_(part ? part->end : source.velocity.size()),
      wall_unknown_(source.walls.size(), -1) {
  for (std::size_t w = 0; w < source.walls.size(); ++w) {
    if (source.walls[w].inv_mass == 0) continue;
    wall_unknown_[w] = static_cast<std::int32_t>(grains() + walls_.size());
    walls_.push_back(w);
  }
}

BodyUnknown StepReader::unknown_of_slot(std::size_t slot) const {
  const Velocity& v = source_.velocity[slot];
  BodyUnknown body;
  body.mass = copies(slot) / v.inv_mass;
  if (v.spin_mobility > 0 && !source_.free.w.empty()) body.spin_mass = copies(slot) / v.spin_mobility;
  body.x = source_.x[slot];
  body.radius = source_.radius[slot];
  body.free.u = Eigen::Map<const Vec3>(source_.free.u[slot].data());
  if (body.spin_mass > 0) body.free.w = Eigen::Map<const Vec3>(source_.free.w[slot].data());
  return body;
}

BodyUnknown StepReader::unknown_of_source(std::size_t body) const {
  if (body < grains()) return unknown_of_slot(begin_ + body);
  if (body < grains() + walls_.size()) return unknown_of_wall(source_.walls[walls_[body - grains()]]);
  return unknown_of_cell(source_.cell);
}

BodyUnknown StepReader::unknown(std::size_t body) const {
  BodyUnknown unknown = unknown_of_source(body);
  if (!free_.empty()) unknown.free = free_[body];
  return unknown;
}

double StepReader::mass(std::size_t body) const {
  if (body < grains()) return copies(begin_ + body) / source_.velocity[begin_ + body].inv_mass;
  if (body < grains() + walls_.size()) return 1 / source_.walls[walls_[body - grains()]].inv_mass;
  return source_.cell.mass;
}

bool StepReader::counted(std::size_t body) const {
  if (!part_) return true;
  return body < grains() ? part_->counts[begin_ + body] != 0 : part_->subdomain == 0;
}

bool StepReader::shared(std::size_t body) const {
  return part_ && (body >= grains() || part_->multiplicity[begin_ + body] > 1);
}

std::size_t StepReader::contacts() const {
  std::size_t count = 0;
  for (std::size_t c = 0; c < source_.chunks.size(); ++c)
    if (!part_ || source_.chunks.subdomain[c] == part_->local) count += at(source_.contacts.count[c]);
  return count;
}

std::array<std::int32_t, 2> StepReader::pair_at(std::size_t chunk, std::size_t place) const {
  const auto first_slot = static_cast<Slot>(begin_);
  const std::int32_t w = source_.chunks.wall[chunk];
  return {source_.contacts.first[place] - first_slot,
          w < 0 ? source_.contacts.second[place] - first_slot : wall_unknown_[at(w)]};
}

/// The speed at which the flow of a cell moves two touching bodies against one another [m/s]: that of the
/// image's drift, scaled from the distance of the image to theirs. In a cell that follows a stress most of
/// the drift is what the stress would do without contacts, and drives nothing, as the load of a pushed wall:
/// there the fastest prescribed component counts, whichever axis it is of.
double StepReader::drive_of_flow(const ContactEquation& contact, const Vec3& drift) const {
  if (drift == Vec3::Zero()) return 0;
  const std::size_t a = begin_ + at(contact.first), b = begin_ + at(contact.second);
  const double near = source_.radius[a] + source_.radius[b];
  if (has_cell()) return near * source_.cell.driven;
  const double far = (source_.x[a] - source_.x[b] - near * contact.normal).norm();
  return far > 0 ? drift.norm() * near / far : 0;
}

ContactEquation StepReader::equation_at(std::size_t chunk, std::size_t place) const {
  const Contacts& contacts = source_.contacts;
  const std::int32_t w = source_.chunks.wall[chunk];
  ContactEquation contact;
  contact.normal = contact_normal(contacts, place);
  contact.offset = contacts.bias[place] * contact.normal;
  contact.mu = friction_of(source_.laws, source_.chunks, chunk, contacts, place);
  const auto [first, second] = pair_at(chunk, place);
  contact.first = first;
  contact.second = second;
  if (w >= 0) {
    const Vec3 drive = source_.walls[at(w)].free_velocity + drift_of(contacts, place);
    // Of a wall of finite mass only the normal velocity is an unknown.
    // A wall that stretches with a flow moves nothing against the grains, which flow too.
    if (second < 0)
      contact.drive = contacts.drifts_between ? source_.walls[at(w)].free_velocity.norm() : drive.norm();
    contact.offset -= second < 0 ? drive : Vec3(drive - unknown_of_source(at(second)).free.u);
  }
  if (w < 0 && contacts.drifts_between) {
    const Vec3 drift = drift_of(contacts, place);
    contact.drive = drive_of_flow(contact, drift);
    contact.offset -= drift;
  }
  if (has_cell()) {
    contact.cell = cell();
    if (w < 0) contact.branch = contacts.reach[place] * contact.normal;
  }
  if (!contacts.cohesion.empty()) contact.pull = contacts.cohesion[place];
  contact.place = static_cast<std::int32_t>(place);
  contact.wall = w;
  if (source_.chunks.kind[chunk] == ChunkKind::blocks) contact.levers = &contacts.levers[place];
  return contact;
}

Vec3 StepReader::impulse_of(const ContactEquation& contact) const {
  const std::size_t place = at(contact.place);
  return kept_ != nullptr ? kept_->force(candidate_at(place), contact.normal)
                          : law_impulse(source_.contacts, place);
}

void StepReader::each_contact(const Visit& visit) const {
  each_place([&](std::size_t chunk, std::size_t place) {
    const ContactEquation contact = equation_at(chunk, place);
    visit(contact, impulse_of(contact));
  });
}

Vec3 StepReader::moment_at(std::size_t place) const {
  const Contacts& contacts = source_.contacts;
  return kept_ != nullptr ? kept_->moment(candidate_at(place)) : contact_moment(contacts, place);
}

RollingPart StepReader::rolling_at(std::size_t place) const {
  const Contacts& contacts = source_.contacts;
  const bool turning = !contacts.spin.empty() && contacts.second[place] < 0;
  return {contacts.arm[place], turning ? contacts.spin[place] : Vec3(Vec3::Zero()), moment_at(place)};
}

/// Adds what the moment of a contact does to its bodies.
void StepReader::add_moment(std::size_t place, const ContactEquation& contact, std::span<Twist> known) const {
  const Vec3 moment = moment_at(place);
  const auto turn = [&](std::int32_t body, double sign) {
    if (body < 0) return;
    const BodyUnknown unknown = unknown_of_source(at(body));
    if (unknown.kind != BodyKind::wall) known[at(body)].w += sign / unknown.radius * moment;
  };
  turn(contact.first, 1);
  turn(contact.second, -1);
}

void StepReader::add_known(std::span<Twist> known) const {
  const Contacts& contacts = source_.contacts;
  each_place([&](std::size_t chunk, std::size_t place) {
    const ContactEquation contact = equation_at(chunk, place);
    if (!contacts.arm.empty()) add_moment(place, contact, known);
    if (contact.pull > 0) add_force(contact, -contact.pull * contact.normal, known);
  });
}

}  // namespace talus
