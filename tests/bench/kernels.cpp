/// One sweep over grain-grain contacts by every kernel, beside one another in one run: a stored Delassus
/// operator, the scalar kernel, and the kernels of each instruction set; at 2000, 16,000 and 200,000 grains,
/// with friction and without.
///
///   bench_kernels [SPHERES.csv] [REPEATS]
///
/// SPHERES.csv as for bench_sweep; the sample is cut or repeated to each size. Times are thread CPU time per
/// contact and sweep, best and median over the repeats (default 15) of one to a few sweeps, one thread, chunk
/// after chunk. The sample contracts and its grains turn, so that contacts open, stick and slide.

#include <cstdlib>
#include <functional>
#include <numeric>

#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "kernels/sweeps/single_precision.hpp"
#include "runtime/step/decomposition.hpp"
#include "tests/bench/clocks.hpp"
#include "tests/bench/packing.hpp"

namespace {

using namespace talus;
using bench::cpu_now;

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

struct Sample {
  Bodies bodies;
  Candidates candidates;
  Chunks chunks;
  Contacts contacts;
  std::size_t count = 0;  ///< contacts
  std::size_t full = 0;   ///< contacts in groups of 16
};

/// The packing until there are `grains`: its first grains, or copies side by side in a block 2 wide and 3
/// deep.
Sample make_sample(const bench::Packing& packing, std::size_t grains, bool friction) {
  Sample sample;
  Bodies& bodies = sample.bodies;
  for (std::size_t k = 0; k < grains; ++k) {
    const std::size_t from = k % packing.bodies.size(), copy = k / packing.bodies.size();
    const Vec3 shift(static_cast<double>(copy % 2), static_cast<double>(copy / 2 % 3),
                     static_cast<double>(copy / 6));
    add_sphere(bodies, BodyId{static_cast<std::int64_t>(k)}, packing.bodies.x[from] + packing.edge * shift,
               packing.bodies.radius[from], 1.0);
  }
  reorder(bodies, morton_order(bodies));
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> turn(-1, 1);
  for (std::size_t s = 0; s < bodies.size(); ++s)
    for (std::size_t c = 0; c < 3; ++c) {
      bodies.velocity[s].u[c] = -bodies.x[s][static_cast<Eigen::Index>(c)] + turn(random);
      bodies.velocity[s].w[c] = turn(random);
    }
  std::vector<double> reach = bodies.radius;
  for (double& r : reach) r += 0.11;
  const CellGrid grid = build_cells(bodies.x, reach);
  std::vector<std::vector<GrainPair>> parts(1);
  find_pairs(grid, 0, grid.cells.size(), parts[0]);
  Candidates& candidates = sample.candidates;
  candidates.impulse = KeptImpulses(friction ? ImpulseKind::force : ImpulseKind::normal);
  candidates.grain_pairs = sort_pairs(parts, bodies.size());
  candidates.impulse.assign_zeros(candidates.size());
  const auto all = static_cast<std::int64_t>(candidates.size());
  sample.chunks = cut_chunks(candidates, bodies.size(), chunk_target(all, all));
  allocate(sample.contacts, candidates, sample.chunks, friction);
  const NarrowPhase in{bodies.x, bodies.radius, bodies.velocity, {}, 0.01, 0.02, {}, Vec3::Zero()};
  const SweepKernels kernels(best_instruction_set());
  for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
    narrow_chunk(in, candidates, sample.chunks, c, kernels.set(), sample.contacts);
    const std::size_t begin = at(sample.chunks.begin[c]), count = at(sample.contacts.count[c]);
    sample.count += count;
    for (std::size_t k = 0, g = begin; k < count; k += sample.contacts.group[g++])
      if (sample.contacts.group[g] == 16) sample.full += 16;
  }
  return sample;
}

/// The baseline of most codes: v = W r + v_free with W stored in rows of blocks, about 12 besides the
/// diagonal one. Without friction a block is a number.
template <bool Friction>
class StoredDelassus {
 public:
  explicit StoredDelassus(const Sample& sample) {
    const Contacts& c = sample.contacts;
    std::vector<std::vector<std::int32_t>> around(sample.bodies.size());
    for (std::size_t chunk = 0; chunk < sample.chunks.size(); ++chunk)
      for (std::size_t k = at(sample.chunks.begin[chunk]), n = at(sample.contacts.count[chunk]); n > 0;
           ++k, --n) {
        around[at(c.first[k])].push_back(static_cast<std::int32_t>(rows_.size()));
        around[at(c.second[k])].push_back(static_cast<std::int32_t>(rows_.size()));
        rows_.push_back(row_of(sample, k));
      }
    r_.assign(rows_.size() * width, 0.0);
    for (std::size_t a = 0; a < rows_.size(); ++a) {
      for (const Slot body : {rows_[a].first, rows_[a].second})
        for (const std::int32_t b : around[at(body)])
          if (at(b) != a) add_block(sample, body, a, at(b));
      rows_[a].end = column_.size();
    }
  }

  double blocks_per_contact() const {
    return static_cast<double>(column_.size()) / static_cast<double>(rows_.size());
  }

  void sweep(double mu) {
    std::size_t k = 0;
    for (std::size_t a = 0; a < rows_.size(); ++a) {
      const Row& row = rows_[a];
      double* r = &r_[width * a];
      if constexpr (Friction) {
        double x = row.v[0], y = row.v[1], z = row.v[2];
        for (; k < row.end; ++k) {
          const double* w = &block_[9 * k];
          const double* s = &r_[3 * at(column_[k])];
          x += w[0] * s[0] + w[1] * s[1] + w[2] * s[2];
          y += w[3] * s[0] + w[4] * s[1] + w[5] * s[2];
          z += w[6] * s[0] + w[7] * s[1] + w[8] * s[2];
        }
        const double* n = row.n;
        const double v_n = x * n[0] + y * n[1] + z * n[2];
        const double next = -(v_n + row.bias) / row.w_nn;  // v holds nothing of this contact's own impulse
        const double r_n_new = 0.5 * (next + std::abs(next)), limit = mu * r_n_new;
        const double t[3] = {-(x - v_n * n[0]) / row.w_tt, -(y - v_n * n[1]) / row.w_tt,
                             -(z - v_n * n[2]) / row.w_tt};
        const double t2 = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
        const double scale = t2 > limit * limit ? limit / std::sqrt(t2) : 1;
        for (int d = 0; d < 3; ++d) r[d] = r_n_new * n[d] + scale * t[d];
      } else {
        double v = row.v[0];
        for (; k < row.end; ++k) v += block_[k] * r_[at(column_[k])];
        const double next = -(v + row.bias) / row.w_nn;
        *r = 0.5 * (next + std::abs(next));
      }
    }
  }

 private:
  static constexpr std::size_t width = Friction ? 3 : 1;
  struct Row {
    double n[3], v[3], bias, w_nn, w_tt;
    Slot first, second;
    std::size_t end = 0;  ///< of its blocks
  };

  static Row row_of(const Sample& sample, std::size_t k) {
    const Contacts& c = sample.contacts;
    Row row{{c.nx[k], c.ny[k], c.nz[k]}, {}, c.bias[k], 0, 0, c.first[k], c.second[k]};
    const Velocity &a = sample.bodies.velocity[at(row.first)], &b = sample.bodies.velocity[at(row.second)];
    const Vec3 n(row.n), u = Vec3(a.u) - Vec3(b.u), w = Vec3(a.w) + Vec3(b.w);
    Vec3 v = u - Vec3(w[1] * n[2] - w[2] * n[1], w[2] * n[0] - w[0] * n[2], w[0] * n[1] - w[1] * n[0]);
    if (!Friction) v[0] = u.dot(n);
    std::copy_n(v.data(), 3, row.v);
    row.w_nn = a.inv_mass + b.inv_mass;
    row.w_tt = row.w_nn + a.spin_mobility + b.spin_mobility;
    return row;
  }

  /// What an impulse at b gives to the relative velocity at a, through a body that both touch.
  void add_block(const Sample& sample, Slot body, std::size_t a, std::size_t b) {
    const Velocity& v = sample.bodies.velocity[at(body)];
    const double sign = (rows_[a].first == body) == (rows_[b].first == body) ? 1 : -1;
    const Vec3 n_a(rows_[a].n), n_b(rows_[b].n);
    column_.push_back(static_cast<std::int32_t>(b));
    if constexpr (Friction) {
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          block_.push_back((i == j ? sign * v.inv_mass + v.spin_mobility * n_a.dot(n_b) : 0) -
                           v.spin_mobility * n_b[i] * n_a[j]);
    } else {
      block_.push_back(sign * v.inv_mass * n_a.dot(n_b));
    }
  }

  std::vector<Row> rows_;
  std::vector<std::int32_t> column_;
  std::vector<double> block_, r_;
};

struct Time {
  double best, median;  ///< [ns] per contact and sweep
};

Time time_of(std::size_t contacts, int repeats, const std::function<void()>& sweep) {
  const int sweeps = contacts < 100000 ? 5 : 1;
  std::vector<double> times;
  for (int repeat = 0; repeat <= repeats; ++repeat) {
    const double start = cpu_now();
    for (int k = 0; k < sweeps; ++k) sweep();
    if (repeat > 0)  // the first one warms up
      times.push_back(1e9 * (cpu_now() - start) / sweeps / static_cast<double>(contacts));
  }
  std::sort(times.begin(), times.end());
  return {times.front(), times[times.size() / 2]};
}

template <bool Friction>
void report(const bench::Packing& packing, std::size_t grains, int repeats) {
  constexpr double mu = Friction ? 0.35 : 0;
  const Sample sample = make_sample(packing, grains, Friction);
  const auto row = [&](std::string_view name, Time time) {
    fmt::print("{:<22}{:>10.2f}{:>10.2f}\n", name, time.best, time.median);
  };
  const auto over_chunks = [&](const auto& kernel) {
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      const std::size_t begin = at(sample.chunks.begin[c]);
      kernel(ContactRange{begin, begin + at(sample.contacts.count[c])});
    }
  };
  fmt::print("\n{}: {} grains, {} candidates, {} contacts ({:.1f} % in groups of 16), {} chunks\n",
             Friction ? "friction 0.35" : "frictionless", grains, sample.candidates.size(), sample.count,
             100 * static_cast<double>(sample.full) / static_cast<double>(sample.count),
             sample.chunks.size());
  fmt::print("{:<22}{:>10}{:>10}\n", "ns/contact/sweep", "best", "median");
  {
    StoredDelassus<Friction> stored(sample);
    row(fmt::format("stored, {:.1f} blocks", stored.blocks_per_contact()),
        time_of(sample.count, repeats, [&] { stored.sweep(mu); }));
  }
  // Of one sweep: the same bits on all sets.
  std::vector<double> expected;
  for (const InstructionSet set : {InstructionSet::portable, InstructionSet::avx2, InstructionSet::avx512}) {
    if (set > best_instruction_set()) continue;
    const SweepKernels kernels(set);
    Contacts contacts = sample.contacts;
    std::vector<Velocity> own = sample.bodies.velocity;
    row(name_of(set), time_of(sample.count, repeats, [&] {
          over_chunks([&](ContactRange range) { kernels.sweep_grains<Friction>(contacts, range, own, mu); });
        }));
    Contacts swept = sample.contacts;
    std::vector<Velocity> moved = sample.bodies.velocity;
    over_chunks([&](ContactRange range) { kernels.sweep_grains<Friction>(swept, range, moved, mu); });
    const std::vector<double>& found = Friction ? swept.rx : swept.rn;
    if (expected.empty()) expected = found;
    if (found != expected)
      throw std::logic_error("the kernels of " + std::string(name_of(set)) + " disagree with the others");
    SweepSteps steps;
    const std::vector<float> still(contacts.nx.size(), 0.0F);
    if constexpr (Friction)
      steps.x = steps.y = steps.z = still;
    else
      steps.n = still;
    row("  with momentum", time_of(sample.count, repeats, [&] {
          over_chunks([&](ContactRange range) {
            kernels.sweep_grains<Friction>(contacts, range, own, mu, {0.5, 1.2, steps});
          });
        }));
    SingleState single;
    allocate(single, contacts, own.size());
    single.contacts.unit = unit_of_mass(own[0].inv_mass);
    std::vector<Slot> slots(own.size());
    std::iota(slots.begin(), slots.end(), 0);
    narrow_bodies(slots, sample.bodies.velocity, single);
    narrow_geometry(contacts, {0, contacts.nx.size()}, single.contacts);
    row("  the same, single", time_of(sample.count, repeats, [&] {
          over_chunks([&](ContactRange range) {
            kernels.sweep_grains<Friction>(contacts, single, range, mu, {0.5, 1.2, steps});
          });
        }));
    row("  natural map", time_of(sample.count, repeats, [&] {
          over_chunks([&](ContactRange range) { kernels.error_grains<Friction>(contacts, range, own, mu); });
        }));
    row("  V afresh from r", time_of(sample.count, repeats, [&] {
          over_chunks([&](ContactRange range) { kernels.accumulate_grains<Friction>(contacts, range, own); });
        }));
    const NarrowPhase in{sample.bodies.x, sample.bodies.radius, sample.bodies.velocity, {}, 0.01, 0.02, {},
                         Vec3::Zero()};
    for (const bool anew : {false, true})
      row(anew ? "  narrow phase, all groups anew" : "  narrow phase, groups kept",
          time_of(sample.count, repeats, [&] {
            if (anew) contacts.count.assign(contacts.count.size(), 0);
            for (std::size_t c = 0; c < sample.chunks.size(); ++c)
              narrow_chunk(in, sample.candidates, sample.chunks, c, kernels.set(), contacts);
          }));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Packing packing = argc > 1 ? bench::read_packing(argv[1]) : bench::make_packing();
  const int repeats = argc > 2 ? std::max(5, std::atoi(argv[2])) : 15;
  for (const std::size_t grains : {2000u, 16000u, 200000u}) {
    report<true>(packing, grains, repeats);
    report<false>(packing, grains, repeats);
  }
}
