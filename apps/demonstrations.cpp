#include "apps/demonstrations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <stdexcept>

#include "configs/spelling.hpp"
#include "model/effects/chain.hpp"
#include "model/effects/numbers.hpp"

namespace vcnc {
namespace {

using Wall = ExperimentOptions::Wall;

/// What the figures are read for. `automatic` picks what is largest.
enum class Feature {
  automatic,
  peak_to_peak,
  step,
  spike,
  mean,
  harmonic1,
  harmonic2,
  slope,
  per_minute,
  direction,
  scatter,
  largest
};

/// What does not follow from port, family and place.
struct Peculiarity {
  std::string_view effect;
  std::optional<Showing> showing = std::nullopt;
  std::optional<std::size_t> axis = std::nullopt;
  std::optional<Quantity> quantity = std::nullopt;
  std::optional<Feature> feature = std::nullopt;
  ExperimentOptions options = {};
  void (*prepare)(Machine&, std::size_t axis) = nullptr;
  const char* prepared = "";
};

void no_feed_forward(Machine& m, std::size_t) {
  for (const std::size_t axis : {kX, kY}) {
    m.axes[axis].servo.velocity_ff = 0;
    m.axes[axis].servo.acceleration_ff = 0;
  }
}
/// Friction that holds the load while the motor crosses a gap, without much of its own.
void dragging(Machine& m, std::size_t axis) {
  Coulomb& friction = m.effects.axis[axis].get<Coulomb>();
  friction = Coulomb::nominal(is_rotary(axis));
  friction.level *= 0.2;
}
void motor_encoder(Machine& m, std::size_t axis) {
  m.axes[axis].servo.feedback = ServoParams::Feedback::motor;
}
void springy(Machine& m, std::size_t axis) {
  m.effects.axis[axis].get<Windup>() = Windup::nominal(is_rotary(axis));
}
void sliding(Machine& m, std::size_t axis) {
  m.effects.axis[axis].get<Coulomb>() = Coulomb::nominal(is_rotary(axis));
}
ExperimentOptions creep() {
  ExperimentOptions o;
  o.travel_mm = 0.1;
  o.feed_mm_min = 6;
  return o;
}
/// Quickly along the normal of a wall.
ExperimentOptions quick_press() {
  ExperimentOptions o;
  o.travel_mm = 0.8;
  o.feed_mm_min = 2000;
  return o;
}
/// The same with long rests.
ExperimentOptions late_press() {
  ExperimentOptions o = quick_press();
  o.seconds = 2;
  return o;
}
/// Into the piece and out of it.
ExperimentOptions touch_and_leave() {
  ExperimentOptions o;
  o.travel_mm = 2;
  o.feed_mm_min = 1000;
  o.seconds = 0.6;
  return o;
}
ExperimentOptions resting(double seconds) {
  ExperimentOptions o;
  o.seconds = seconds;
  return o;
}
/// In the air, with strokes that ask for a little more than half of the largest acceleration.
ExperimentOptions quick_strokes() {
  ExperimentOptions o;
  o.wall = Wall::none;
  o.travel_mm = 65;
  return o;
}
ExperimentOptions against(const Vec3& normal) {
  ExperimentOptions o;
  o.normal = normal;
  return o;
}

const std::vector<Peculiarity>& peculiarities() {
  static const std::vector<Peculiarity> table{
      {.effect = "kv_error",
       .prepare = no_feed_forward,
       .prepared = "X and Y without feed-forward"},
      {.effect = "integral_time_error", .prepare = sliding, .prepared = "Coulomb friction"},
      {.effect = "velocity_gain_error", .prepare = sliding, .prepared = "Coulomb friction"},
      {.effect = "torque_limit",
       .showing = Showing::reversals,
       .quantity = Quantity::following,
       .feature = Feature::largest,
       .options = quick_strokes()},
      {.effect = "encoder_quantisation", .feature = Feature::peak_to_peak, .options = creep()},
      {.effect = "encoder_subdivision", .feature = Feature::peak_to_peak, .options = creep()},
      {.effect = "lead_error",
       .prepare = motor_encoder,
       .prepared = "measuring system on the motor"},
      {.effect = "transmission_error",
       .prepare = motor_encoder,
       .prepared = "measuring system on the motor"},
      {.effect = "motor_friction", .prepare = springy, .prepared = "a transmission that gives way"},
      {.effect = "weight_imbalance", .axis = kZ},
      {.effect = "lost_motion", .prepare = sliding, .prepared = "Coulomb friction"},
      {.effect = "viscous",
       .showing = Showing::circle_feeds,
       .quantity = Quantity::force,
       .feature = Feature::peak_to_peak},
      {.effect = "nonlinear_viscous",
       .showing = Showing::circle_feeds,
       .quantity = Quantity::force,
       .feature = Feature::peak_to_peak},
      {.effect = "grease_drag",
       .showing = Showing::circle_feeds,
       .quantity = Quantity::force,
       .feature = Feature::peak_to_peak},
      {.effect = "a_axis_offset", .axis = kA},
      {.effect = "a_axis_tilt", .axis = kA, .options = against(Vec3::UnitX())},
      {.effect = "pivot_length", .axis = kA},
      {.effect = "probe_drift", .feature = Feature::per_minute, .options = resting(60)},
      {.effect = "adc_noise", .showing = Showing::standstill, .feature = Feature::scatter},
      {.effect = "sample_jitter", .showing = Showing::reversals, .options = quick_press()},
      {.effect = "sample_latency", .showing = Showing::reversals, .options = quick_press()},
      {.effect = "dropped_samples", .showing = Showing::reversals, .options = quick_press()},
      {.effect = "clock_drift", .showing = Showing::reversals, .options = late_press()},
      {.effect = "thermal_expansion", .showing = Showing::line},
      {.effect = "thermal_warm_up", .showing = Showing::line},
      {.effect = "squareness", .feature = Feature::harmonic2},
      {.effect = "return_to_zero",
       .showing = Showing::reversals,
       .quantity = Quantity::free_reading,
       .feature = Feature::largest,
       .options = touch_and_leave()},
      {.effect = "windup", .feature = Feature::step},
      {.effect = "backlash", .feature = Feature::step},
      {.effect = "load_play", .feature = Feature::step},
  };
  return table;
}

const Peculiarity& peculiarity_of(std::string_view effect) {
  static const Peculiarity nothing{};
  for (const Peculiarity& e : peculiarities())
    if (e.effect == effect) return e;
  return nothing;
}

// -------------------------------------------------------------------------- what an effect needs

template <class Port, class... Ports>
constexpr bool one_of = (std::is_same_v<Port, Ports> || ...);

/// Collects "key = value" of an effect's members.
class SettingWriter {
 public:
  void operator()(std::string_view key, const double& v, Unit u, Range, const char*) {
    add(key, fmt::format("{:.6g}", v / u.to_si));
  }
  void operator()(std::string_view key, const Vec3& v, Unit u, Range, const char*) {
    add(key, fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x() / u.to_si + 0.0, v.y() / u.to_si + 0.0,
                         v.z() / u.to_si + 0.0));
  }
  void operator()(std::string_view key, const int& v, Range, const char*) {
    add(key, fmt::format("{}", v));
  }
  const std::string& text() const { return text_; }

 private:
  void add(std::string_view key, const std::string& value) {
    text_ += fmt::format("{}{} = {}", text_.empty() ? "" : ", ", key, value);
  }
  std::string text_;
};

/// The numbers of an effect at its nominal values.
template <class Effect>
std::string setting_of(bool rotary) {
  SettingWriter writer;
  const Effect nominal = nominal_of<Effect>(rotary);
  if constexpr (Effect::place == Place::axis)
    Effect::fields(nominal, writer, rotary);
  else
    Effect::fields(nominal, writer);
  return writer.text();
}

template <class Effect>
std::size_t usual_axis() {
  const bool turns = Effect::place == Place::rotary_axis || Effect::text.showing == Showing::spin;
  return turns ? kC : kX;
}

template <class Effect>
Quantity quantity_for(Showing showing) {
  using Port = typename Effect::Port;
  if (showing == Showing::corner) return Quantity::contour;
  if (Effect::text.family == Family::nc) return Quantity::total_error;
  const bool force = one_of<Port, MotorForcePort, LoadForcePort, FrictionPort>;
  const bool loop = one_of<Port, ServoPort, SetpointPort, ReceptionPort>;
  if (showing == Showing::line || showing == Showing::reversals) {
    if (force) return Quantity::force;
    if (loop) return Quantity::following;
  }
  return Quantity::machine_error;
}

template <class Effect>
ExperimentOptions options_for(Showing showing, Quantity quantity) {
  ExperimentOptions o;
  if (std::is_same_v<typename Effect::Port, PosePort>) o.wall = Wall::guide;
  if (quantity == Quantity::force || quantity == Quantity::following)
    o.wall = showing == Showing::line ? Wall::none : Wall::inclined;
  if (Effect::text.family == Family::thermal) o.seconds = 60;
  // So slowly that friction, not inertia, holds the load while the motor crosses a gap.
  if (one_of<Effect, Windup, Backlash>) o.feed_mm_min = 1500;
  return o;
}

/// What the machine needs for the effect to show, both without and with it.
template <class Effect>
std::string prepare(Machine& machine, std::size_t axis) {
  using Port = typename Effect::Port;
  if constexpr (one_of<Effect, Windup, Backlash>) {
    motor_encoder(machine, axis);
    dragging(machine, axis);
    return "measuring system on the motor, some Coulomb friction";
  }
  if constexpr (std::is_same_v<Port, FrictionPort> && !std::is_same_v<Effect, Coulomb>) {
    // Most terms only change dry friction.
    FrictionPort::Signal<double> none;
    Chain<FrictionPort> chain;
    chain.add(nominal_of<Effect>(is_rotary(axis)), Seat{axis, is_rotary(axis), {}});
    FrictionPort::Context<double> context;
    context.velocity = 0.01;
    context.moment.dt = 50e-6;
    chain.step(none, context);
    if (none.dry == 0 && none.viscous == 0) {
      sliding(machine, axis);
      return "Coulomb friction";
    }
  }
  return "";
}

template <class Effect>
Demonstration demonstrate(const Machine& machine) {
  const Peculiarity& peculiar = peculiarity_of(Effect::text.name);
  Demonstration d;
  d.text = &Effect::text;
  Showing showing = peculiar.showing.value_or(Effect::text.showing);
  std::size_t axis = peculiar.axis.value_or(usual_axis<Effect>());
  // Rotary axes have one motion that the probe follows.
  if (is_rotary(axis) && showing != Showing::s_piece) showing = Showing::spin;
  if (showing == Showing::spin && !is_rotary(axis)) axis = kC;
  // Off the scales, only the probe sees it: strokes against a wall instead of a square in the air.
  const bool scales_see_it = !one_of<typename Effect::Port, DisplacementPort, PosePort, TouchPort,
                                     DeflectionPort, AnaloguePort, ReadingPort>;
  const bool off_the_scales = showing == Showing::corner && !scales_see_it;
  if (off_the_scales) showing = Showing::reversals;
  d.quantity = peculiar.quantity.value_or(quantity_for<Effect>(showing));
  ExperimentOptions options = options_for<Effect>(showing, d.quantity);
  if (off_the_scales) options = quick_press();
  // An error of the angle itself moves the piece along the circle, not across it.
  if (showing == Showing::spin && axis == kC && of_axis(Effect::place) &&
      !std::is_same_v<typename Effect::Port, PosePort>)
    options.normal = Vec3::UnitY();
  const ExperimentOptions usual;
  if (peculiar.options.wall != usual.wall) options.wall = peculiar.options.wall;
  if (peculiar.options.feed_mm_min > 0) options.feed_mm_min = peculiar.options.feed_mm_min;
  if (peculiar.options.travel_mm > 0) options.travel_mm = peculiar.options.travel_mm;
  if (peculiar.options.seconds > 0) options.seconds = peculiar.options.seconds;
  if (!peculiar.options.normal.isZero()) options.normal = peculiar.options.normal;

  d.without = experiment(showing, axis, machine, options);
  d.prepared = prepare<Effect>(d.without.machine, axis);
  if (peculiar.prepare) {
    peculiar.prepare(d.without.machine, axis);
    d.prepared += (d.prepared.empty() ? "" : ", ") + std::string(peculiar.prepared);
  }
  d.with = d.without;
  const bool rotary = is_rotary(axis);
  if constexpr (of_axis(Effect::place)) {
    d.where = fmt::format("{} axis", kAxisNames[axis]);
    d.with.machine.effects.axis[axis].template get<Effect>() = nominal_of<Effect>(rotary);
  } else {
    d.where = key_of(Effect::place);
    d.with.machine.effects.template get<Effect>() = nominal_of<Effect>(rotary);
  }
  d.setting = setting_of<Effect>(rotary);
  return d;
}

// -------------------------------------------------------------------------------------- readings

/// A number in a unit with three or four figures.
std::string shown(double si, const Scale& scale) {
  if (scale.to_si == 1e-6 && std::abs(si) < 0.0995e-6)
    return fmt::format("{:.1f} nm", si * 1e9 + 0.0);
  const double value = si / scale.to_si, size = std::abs(value);
  const int digits = size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
  return fmt::format("{:.{}f} {}", value + 0.0, digits, scale.unit);
}

class Reader {
 public:
  Reader(const Demonstration& d, const std::vector<Curve>& without, const std::vector<Curve>& with)
      : d_(d), scale_(scale_of(d)) {
    for (std::size_t i = 0; i < std::min(with.size(), without.size()); ++i)
      off_.push_back(difference(with[i], without[i]));
  }

  std::vector<Reading> read() {
    if (off_.empty() || off_.front().size() < 10) return {};
    const Feature usual = d_.text->family == Family::friction &&
                                  d_.with.abscissa == Abscissa::angle &&
                                  d_.quantity == Quantity::machine_error
                              ? Feature::spike
                              : Feature::automatic;
    const Feature wanted = peculiarity_of(d_.text->name).feature.value_or(usual);
    if (d_.with.showing == Showing::circle_feeds) read_feeds();
    if (wanted == Feature::automatic) {
      if (result_.empty()) read_largest();
    } else if (const auto reading = read(wanted); reading && result_.empty()) {
      result_.push_back(*reading);
    }
    double most = 0;
    for (const Curve& curve : off_) most = std::max(most, peak_to_peak(curve));
    result_.push_back({"peak to peak", shown(most, scale_), most});
    return result_;
  }

 private:
  Reading reading(const char* name, double si) const { return {name, shown(si, scale_), si}; }
  bool rotary_position() const {
    return d_.with.abscissa == Abscissa::position && is_rotary(d_.with.axis);
  }

  std::optional<Reading> read(Feature feature) const {
    const Curve& c = off_.front();
    switch (feature) {
      case Feature::peak_to_peak:
        return reading("peak to peak", peak_to_peak(c));
      case Feature::largest:
        return reading("largest change", max_abs(c));
      case Feature::mean:
        return reading(d_.with.abscissa == Abscissa::angle ? "mean radius" : "mean", mean(c));
      case Feature::scatter:
        return reading("scatter, rms", scatter(c));
      case Feature::harmonic1:
        return reading("first harmonic", harmonic(c, 1).amplitude());
      case Feature::harmonic2:
        return reading("second harmonic", harmonic(c, 2).amplitude());
      case Feature::step:
        return at_reversals("step at the reversal",
                            [](const Curve& curve, double at) { return step_at(curve, at); });
      case Feature::spike:
        return at_reversals("spike at the reversal",
                            [](const Curve& curve, double at) { return spike_at(curve, at); });
      case Feature::slope: {
        const double slope = trend(off_.back()).slope;  // what grows has grown
        if (d_.with.abscissa == Abscissa::position && !is_rotary(d_.with.axis))
          return Reading{"slope", shown(slope * 0.1, scale_) + " per 100 mm", slope};
        return std::nullopt;
      }
      case Feature::per_minute: {
        const double slope = trend(c).slope;
        return Reading{"drift", shown(slope * 60, scale_) + " per minute", slope};
      }
      case Feature::direction:
        if (off_.size() == 2)
          if (const auto between = mean_difference(off_[1], off_[0]))
            return reading("forward against back", *between);
        return std::nullopt;
      case Feature::automatic:
        break;
    }
    return std::nullopt;
  }

  /// Mean magnitude at the two reversals of the axis.
  template <class F>
  std::optional<Reading> at_reversals(const char* name, F&& f) const {
    if (d_.with.abscissa != Abscissa::angle) return std::nullopt;
    const double first = d_.with.axis == kY ? kPi / 2 : 0;
    double sum = 0;
    for (const double at : {first, first + kPi}) {
      const auto value = f(off_.front(), at);
      if (!value) return std::nullopt;
      sum += std::abs(*value);
    }
    return reading(name, sum / 2);
  }

  /// The feature that explains most of the change: each stands for the amplitude that goes with it.
  void read_largest() {
    struct Candidate {
      Feature feature;
      double weight;  ///< amplitude per unit of the reading
    };
    std::vector<Candidate> candidates;
    switch (d_.with.abscissa) {
      case Abscissa::angle:
        candidates = {{Feature::mean, 1},
                      {Feature::harmonic1, 1},
                      {Feature::harmonic2, 1},
                      {Feature::step, 0.6},
                      {Feature::scatter, 0.9}};
        break;
      case Abscissa::position:
        if (rotary_position())
          candidates = {{Feature::mean, 1},
                        {Feature::harmonic1, 1},
                        {Feature::harmonic2, 1},
                        {Feature::direction, 0.5},
                        {Feature::scatter, 0.9}};
        else
          candidates = {{Feature::mean, 1},
                        {Feature::slope, 0.03},
                        {Feature::direction, 0.5},
                        {Feature::scatter, 1}};
        break;
      case Abscissa::time:
        if (d_.with.showing == Showing::standstill) {
          const double way = off_.front().x.back() - off_.front().x.front();
          candidates = {
              {Feature::mean, 1}, {Feature::per_minute, way / 2}, {Feature::scatter, 1.5}};
        } else {
          candidates = {{Feature::largest, 1}};
        }
        break;
      case Abscissa::station:
        candidates = {
            {d_.with.showing == Showing::corner ? Feature::largest : Feature::scatter, 1}};
        break;
    }
    const auto weight = [](const Candidate& c, const std::optional<Reading>& r) {
      return r ? c.weight * std::abs(r->si) : -1;
    };
    std::vector<std::pair<double, Reading>> found;
    for (const Candidate& c : candidates)
      if (const auto r = read(c.feature)) found.emplace_back(weight(c, r), *r);
    if (found.empty()) return;
    result_.push_back(
        std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
          return a.first < b.first;
        })->second);
  }

  void read_feeds() {
    std::vector<double> feed, size;
    std::string list;
    for (std::size_t i = 0; i < off_.size(); ++i) {
      const double amplitude = 0.5 * peak_to_peak(off_[i]);
      const double value =
          std::max(std::abs(mean(off_[i])), amplitude) == amplitude ? 2 * amplitude : mean(off_[i]);
      feed.push_back(d_.with.passes[i].feed);
      size.push_back(value);
      list += (i ? ", " : "") + shown(value, scale_);
    }
    const auto n = growth_exponent(feed, size);
    result_.push_back({"at the three feeds", list, size.back()});
    if (n && std::abs(size.back()) > 1e-9)
      result_.push_back({"grows with the feed to the power of", fmt::format("{:.1f}", *n), *n});
  }

  const Demonstration& d_;
  Scale scale_;
  std::vector<Curve> off_;
  std::vector<Reading> result_;
};

}  // namespace

std::vector<const EffectText*> all_effect_texts() {
  std::vector<const EffectText*> all;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) { all.push_back(&Effect::text); });
  std::stable_sort(all.begin(), all.end(),
                   [](const EffectText* a, const EffectText* b) { return a->family < b->family; });
  return all;
}

Demonstration demonstration(std::string_view effect, const Machine& machine) {
  std::optional<Demonstration> found;
  for_each_effect([&]<class Effect>(std::type_identity<Effect>) {
    if (Effect::text.name == effect) found = demonstrate<Effect>(machine);
  });
  if (found) return *std::move(found);
  std::string_view nearest;
  for (const EffectText* text : all_effect_texts())
    if (nearest.empty() || edit_distance(text->name, effect) < edit_distance(nearest, effect))
      nearest = text->name;
  throw std::invalid_argument(
      fmt::format("{}: there is no such effect; did you mean {}?", effect, nearest));
}

Scale scale_of(const Demonstration& d) {
  const bool rotary = is_rotary(d.with.axis);
  switch (d.quantity) {
    case Quantity::force:
      return {rotary ? "N m" : "N", 1};
    case Quantity::following:
      return rotary ? Scale{"arcsec", unit::arcsec.to_si} : Scale{"\u00b5m", 1e-6};
    default:
      return {"\u00b5m", 1e-6};
  }
}

Scale abscissa_scale_of(const Demonstration& d) {
  switch (d.with.abscissa) {
    case Abscissa::angle:
      return {"deg", kDegree};
    case Abscissa::position:
      return is_rotary(d.with.axis) ? Scale{"deg", kDegree} : Scale{"mm", 1e-3};
    case Abscissa::time:
      return {"s", 1};
    case Abscissa::station:
      break;
  }
  return {"mm", 1e-3};
}

std::vector<Reading> readings(const Demonstration& d, const std::vector<Curve>& without,
                              const std::vector<Curve>& with) {
  return Reader(d, without, with).read();
}

}  // namespace vcnc
