#include "kernels/global/body_parts.hpp"

#include <utility>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/larger.hpp"

namespace talus {

void PartLink::each(std::size_t parts, const std::function<void(std::size_t)>& work) const {
  for (std::size_t p = 0; p < parts; ++p) work(p);
}

void PartLink::sum_copies(PartField& /*field*/) const {}

std::vector<double> PartLink::gather(std::vector<std::vector<double>> rows) const {
  return std::move(rows.front());
}

PartField BodyParts::field() const {
  PartField field(size());
  for (std::size_t p = 0; p < size(); ++p) field[p].resize(parts_[p].bodies.size());
  return field;
}

std::vector<double> rows_of(const PartLink& link, std::size_t parts, std::size_t width, const PartRow& fill) {
  std::vector<std::vector<double>> rows(parts, std::vector<double>(width, 0.0));
  link.each(parts, [&](std::size_t p) { fill(p, rows[p]); });
  return link.gather(std::move(rows));
}

std::vector<double> total_of(const PartLink& link, std::size_t parts, std::size_t width,
                             const PartRow& fill) {
  return reduced_of(link, parts, {.sums = width, .largest = 0}, 1, fill);
}

void RowColumns::add(std::span<const double> row, std::span<double> to) const {
  for (std::size_t k = 0; k < row.size(); ++k)
    to[k] = k % width() < sums ? to[k] + row[k] : larger(to[k], row[k]);
}

std::vector<double> reduced_of(const PartLink& link, std::size_t parts, RowColumns columns,
                               std::size_t groups, const PartRow& fill) {
  const std::size_t length = columns.width() * groups;
  const std::vector<double> rows = rows_of(link, parts, length, fill);
  std::vector<double> all(length, 0.0);
  for (std::size_t begin = 0; begin < rows.size(); begin += length)
    columns.add(std::span(rows).subspan(begin, length), all);
  return all;
}

double BodyParts::dot(const PartField& a, const PartField& b) const {
  return total(1, [&](std::size_t p, std::span<double> row) {
    double sum = 0;
    for (std::size_t k = 0; k < a[p].size(); ++k)
      if (parts_[p].counted(k)) sum += talus::dot(a[p][k], b[p][k]);
    row[0] = sum;
  })[0];
}

PartImpulses impulses_of(const BodyParts& parts) {
  PartImpulses impulse;
  for (std::size_t p = 0; p < parts.size(); ++p) impulse.push_back(parts[p].impulse);
  return impulse;
}

void set_free(std::span<BodyProblem> parts, const PartLink& link) {
  PartField known;
  for (BodyProblem& part : parts) {
    part.known.resize(part.bodies.size());
    known.push_back(part.known);
  }
  link.sum_copies(known);
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (std::size_t b = 0; b < known[p].size(); ++b) {
      velocity_from_force(parts[p].bodies[b], known[p][b]);
      parts[p].bodies[b].free = known[p][b];
    }
}

namespace {

/// impulse_of(p): those of part p.
template <class ImpulseOf>
PartField velocities_from(const BodyParts& parts, const ImpulseOf& impulse_of) {
  PartField V = parts.field();
  parts.each([&](std::size_t p) {
    const auto& contacts = parts[p].contacts;
    const std::span<const Vec3> impulse = impulse_of(p);
    for (std::size_t k = 0; k < contacts.size(); ++k) add_force(contacts[k], impulse[k], V[p]);
  });
  parts.link().sum_copies(V);
  parts.each([&](std::size_t p) {
    for (std::size_t b = 0; b < V[p].size(); ++b) velocity_from_force(parts[p].bodies[b], V[p][b]);
  });
  return V;
}

}  // namespace

PartField velocities_of(const BodyParts& parts, const PartImpulses& impulse) {
  return velocities_from(parts, [&](std::size_t p) { return std::span(impulse[p]); });
}

PartField velocities_of(const BodyParts& parts) {
  return velocities_from(parts, [&](std::size_t p) { return std::span(parts[p].impulse); });
}

std::vector<std::vector<std::int32_t>> heavy_unknowns(const BodyParts& parts, double ratio) {
  // Mass of the neighbours, and their number.
  PartField around = parts.field();
  parts.each([&](std::size_t p) {
    const BodyProblem& problem = parts[p];
    for (const ContactEquation& c : problem.contacts) {
      if (c.second < 0) continue;
      around[p][at(c.first)].u += Vec3(problem.bodies[at(c.second)].mass, 1, 0);
      around[p][at(c.second)].u += Vec3(problem.bodies[at(c.first)].mass, 1, 0);
      if (c.cell >= 0) around[p][at(c.cell)].u += Vec3(0, 1, 0);
    }
  });
  parts.link().sum_copies(around);
  std::vector<std::vector<std::int32_t>> heavy(parts.size());
  parts.each([&](std::size_t p) {
    const BodyProblem& problem = parts[p];
    for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
      const double mass = around[p][b].u[0], neighbours = around[p][b].u[1];
      if (problem.counted(b) && neighbours > 0 &&
          (problem.bodies[b].kind != BodyKind::grain || problem.bodies[b].mass * neighbours > ratio * mass))
        heavy[p].push_back(static_cast<std::int32_t>(b));
    }
  });
  return heavy;
}

}  // namespace talus
