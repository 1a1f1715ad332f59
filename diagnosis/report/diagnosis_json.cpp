#include "diagnosis/report/diagnosis_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "diagnosis/candidates/freed_number.hpp"
#include "diagnosis/replica/model_comparison.hpp"

namespace vcnc {

namespace {

using Json = nlohmann::ordered_json;

Json finite(double v) { return std::isfinite(v) ? Json(v) : Json(); }

Json number(const FittedNumber& n) {
  return {{"key", n.key}, {"value", n.value}, {"low", finite(n.low)}, {"high", finite(n.high)}};
}

Json effect(const FoundEffect& e, const Machine& declared) {
  Json numbers = Json::array();
  for (const FittedNumber& n : e.numbers) {
    numbers.push_back(number(n));
    numbers.back()["declared"] = number_of(declared, n.key);
  }
  return {{"name", e.name},
          {"axis", e.place},
          {"parameters", numbers},
          {"gain", finite(e.gain)},
          {"class", e.class_with},
          {"separating_program", e.separating_program},
          {"contour_error_um", finite(e.contour_error_um)},
          {"minor", e.minor},
          {"acquisition", e.acquisition}};
}

Json figure_json(const SignalFigure& f) {
  const ShownUnit unit = shown_unit(f.channel);
  return {{"signal", channel_name(f.channel)},
          {"run", f.run},
          {"unit", unit.name},
          {"rms_before", finite(f.before * unit.factor)},
          {"rms_after", finite(f.after * unit.factor)},
          {"rms_floor", finite(f.floor * unit.factor)}};
}

Json excitation(const Excitation& e) {
  Json json = {{"name", e.name},
               {"excited", e.excited},
               {"detection_limit", finite(e.detection_limit)},
               {"key", e.key},
               {"unit", unit_of_key(e.key)},
               {"program", e.program}};
  if (e.beside_found) json["detection_limit_beside_found"] = finite(*e.beside_found);
  return json;
}

Json rung(const Rung& r) {
  Json rms = Json::array();
  for (const double v : r.rms) rms.push_back(finite(v));
  return {{"added", r.added}, {"chi2", finite(r.chi2)}, {"rms_si", rms}};
}

Json learned_law(const LearnedLaw& l) {
  return {{"behaves_like", l.words},
          {"share", finite(l.share)},
          {"at", l.law.at},
          {"value", l.law.value},
          {"low", l.low},
          {"high", l.high},
          {"not_distinguishable_from", l.not_distinguishable_from}};
}

/// What the user calls them.
Json axes(const Diagnosis& d) {
  Json names = Json::object();
  for (std::size_t i = 0; i < kAxisCount; ++i)
    if (!d.axis_names[i].empty()) names[std::string(kAxisNames[i])] = d.axis_names[i];
  return names;
}

template <class T, class F>
Json list(const std::vector<T>& all, const F& one) {
  Json result = Json::array();
  for (const T& v : all) result.push_back(one(v));
  return result;
}

}  // namespace

std::string to_json(const Diagnosis& d, const std::string& source) {
  const Json json{
      {"run", source},
      {"verdict", to_string(d.verdict)},
      {"mode", d.differential ? "differential" : "absolute"},
      {"axes", axes(d)},
      {"explained_share", finite(d.explained_share)},
      {"model_form_share", finite(d.model_form_share)},
      {"suspects", d.suspects},
      {"chi2_held_out",
       {{"before", finite(d.chi2.before)},
        {"after", finite(d.chi2.after)},
        {"noise", finite(d.chi2.noise)}}},
      {"effects", list(d.effects, [&](const FoundEffect& e) { return effect(e, d.declared); })},
      {"uncertain", list(d.uncertain, number)},
      {"laws", list(d.laws, learned_law)},
      {"vibrations", d.vibrations},
      {"figures", list(d.figures, figure_json)},
      {"ladder", list(d.ladder, rung)},
      {"excitation", list(d.excitation, excitation)},
      {"warnings", d.warnings},
      {"notes", d.notes}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vcnc
