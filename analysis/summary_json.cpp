#include <nlohmann/json.hpp>

#include "analysis/summary.hpp"
#include "model/math.hpp"

namespace vcnc {
namespace {

using Json = nlohmann::ordered_json;

// Numbers are written as shortest decimals that read back as the same double.
Json statistics(const Statistics& s, double scale, double where_scale) {
  return {{"max", s.max * scale},
          {"min", s.min * scale},
          {"mean", s.mean() * scale},
          {"rms", s.rms() * scale},
          {"peak_to_peak", s.peak_to_peak() * scale},
          {"at_max_mm", s.at_max * where_scale},
          {"at_min_mm", s.at_min * where_scale},
          {"samples", s.count}};
}

Json error_statistics(const Statistics& s) { return statistics(s, 1e6, 1e3); }

Json groups(const Summary& s) {
  Json list = Json::array();
  for (std::size_t i = 1; i < s.groups.size(); ++i) {
    const ErrorGroup& g = s.groups[i];
    list.push_back({{"name", g.name},
                    {"e_n_um", error_statistics(g.e_n)},
                    {"e_plan_um", error_statistics(g.e_plan)},
                    {"e_servo_um", error_statistics(g.e_servo)},
                    {"e_rest_um", error_statistics(g.e_rest)}});
  }
  return list;
}

Json axes(const Summary& s) {
  Json all;
  for (std::size_t j = 0; j < kAxisCount; ++j) {
    const double scale = is_rotary(j) ? 3600 / kDegree : 1e6;
    all[std::string(kAxisNames[j])] = {{"unit", is_rotary(j) ? "arcsec" : "um"},
                                       {"max", s.following[j].max_abs() * scale},
                                       {"rms", s.following[j].rms() * scale},
                                       {"on_path_max", s.following_on_path[j].max_abs() * scale},
                                       {"on_path_rms", s.following_on_path[j].rms() * scale},
                                       {"share_of_e_n_max_um", s.share[j].max_abs() * 1e6},
                                       {"share_of_e_n_rms_um", s.share[j].rms() * 1e6}};
  }
  return all;
}

Json coverage_json(const Summary& s) {
  return {{"percent", s.coverage_percent},
          {"bins", std::ssize(s.bins)},
          {"bins_ok", s.count(Coverage::Bin::ok)},
          {"no_contact", s.count(Coverage::Bin::no_contact)},
          {"out_of_range", s.count(Coverage::Bin::out_of_range)},
          {"invalid", s.count(Coverage::Bin::invalid)},
          {"not_visited", s.count(Coverage::Bin::not_visited)},
          {"bin_length_mm", s.bin_length * 1e3},
          {"path_length_mm", s.line_length * 1e3},
          {"height_mm", s.line_z * 1e3}};
}

Json circles_json(const Summary& s) {
  Json list = Json::array();
  for (const auto& [direction, r] : s.circles) {
    Json steps = Json::array();
    for (const auto& step : r.step) steps.push_back(step ? Json(*step * 1e6) : Json());
    list.push_back({{"direction", direction > 0 ? "ccw" : "cw"},
                    {"mean_um", r.mean * 1e6},
                    {"centre_um", {r.centre_x * 1e6, r.centre_y * 1e6}},
                    {"G_um", r.G * 1e6},
                    {"F_max_um", r.F_max * 1e6},
                    {"F_min_um", r.F_min * 1e6},
                    {"cos2_um", r.cos2 * 1e6},
                    {"sin2_um", r.sin2 * 1e6},
                    {"step_um", steps}});
  }
  return list;
}

Json alarms(const Summary& s) {
  Json list = Json::array();
  for (const Alarm& a : s.alarms)
    list.push_back({{"t_s", seconds(a.tick)},
                    {"tick", a.tick},
                    {"code", a.code},
                    {"source", a.source},
                    {"text", a.text}});
  return list;
}

Json crossings(const Summary& s) {
  Json list = Json::array();
  for (const CrossingMark& c : s.crossings) list.push_back({{"name", c.name}, {"s_mm", c.s * 1e3}});
  return list;
}

}  // namespace

std::string to_json(const Summary& s) {
  const ErrorGroup& whole = s.groups.front();
  const double factor = s.real_time_factor();
  const Json json{{"run_id", s.run_id},
                  {"program", s.program_name},
                  {"machine", s.machine_name},
                  {"piece", s.piece_name},
                  {"seed", s.seed},
                  {"complete", s.end.complete},
                  {"reason", s.end.reason},
                  {"trace_hash", s.end.trace_hash},
                  {"cycles", s.end.cycles},
                  {"rows", s.rows},
                  {"real_time_factor", factor > 0 ? Json(factor) : Json()},
                  {"bus_load_worst", s.end.bus_load_worst},
                  {"gaps", s.gaps()},
                  {"verdict", to_string(s.verdict)},
                  {"verdict_reason", s.verdict_reason},
                  {"tolerance_um", s.tolerance * 1e6},
                  {"predeflection_um", s.predeflection * 1e6},
                  {"interference_um", s.interference ? Json(*s.interference * 1e6) : Json()},
                  {"e_n_um", error_statistics(whole.e_n)},
                  {"e_plan_um", error_statistics(whole.e_plan)},
                  {"e_servo_um", error_statistics(whole.e_servo)},
                  {"e_rest_um", error_statistics(whole.e_rest)},
                  {"coverage", coverage_json(s)},
                  {"following_error", axes(s)},
                  {"lag_um", error_statistics(s.lag)},
                  {"cross_um", error_statistics(s.cross)},
                  {"parts", groups(s)},
                  {"crossings", crossings(s)},
                  {"circles", circles_json(s)},
                  {"alarms", alarms(s)},
                  {"warnings", s.warnings}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vcnc
