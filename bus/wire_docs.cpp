#include "bus/wire_docs.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "bus/wire_table.hpp"

namespace vcnc {

namespace {

constexpr std::array<std::string_view, 8> kNodeNames{"X", "Y",       "Z",     "A",
                                                     "C", "Spindle", "Probe", "Overtravel"};

std::string_view node_name(int node) { return kNodeNames.at(static_cast<std::size_t>(node - 1)); }

/// Sender as a DBC node name.
std::string dbc_node(int node) { return node == 0 ? "NcUnit" : std::string(node_name(node)); }

double largest(const WireField& f) {
  return static_cast<double>(wire::largest_code(f.bytes, f.is_signed)) / f.per_unit;
}

std::string identifiers(const WireMessage& m) {
  if (m.first_node == 0) return fmt::format("{:03X}", m.base);
  if (m.first_node == m.last_node) return fmt::format("{:03X}", m.base + m.first_node);
  return fmt::format("{:03X}..{:03X}", m.base + m.first_node, m.base + m.last_node);
}

void append_message(std::string& text, const WireMessage& m, int node) {
  const std::string named = dbc_node(node);
  const bool several = m.first_node != m.last_node;
  text += fmt::format("BO_ {} {}{}: {} {}\n", m.base + node, m.name,
                      several ? fmt::format("_{}", named) : "", m.length,
                      m.to_node ? dbc_node(0) : named);
  for (const WireField& f : m.fields)
    text += fmt::format(" SG_ {} : {}|{}@1{} ({:.10g},0) [{:.10g}|{:.10g}] \"{}\" {}\n", f.name,
                        8 * f.offset, 8 * f.bytes, f.is_signed ? '-' : '+', 1 / f.per_unit,
                        f.is_signed ? -largest(f) : 0, largest(f), f.unit,
                        node == 0   ? "X,Y,Z,A,C,Spindle,Probe,Overtravel"
                        : m.to_node ? named
                                    : "NcUnit");
  text += '\n';
}

template <class Visit>
void for_each_identifier(const Visit& visit) {
  for (const WireMessage& m : wire_messages())
    for (int node = m.first_node; node <= m.last_node; ++node) visit(m, node);
}

}  // namespace

std::string wire_table_markdown() {
  std::string text =
      "# Messages on the bus\n\n"
      "Generated from the message tables in `bus/messages.cpp`. All numbers are little-endian; "
      "value = "
      "code * scale.\nSigned fields are symmetric; the most negative code means \"not a number\". "
      "Bytes "
      "without a field are 0.\n";
  for (const WireMessage& m : wire_messages()) {
    text += fmt::format("\n## {} ({}, {} byte{}, {})\n\nSent by: {}\n\n", m.name, identifiers(m),
                        m.length, m.length == 1 ? "" : "s", m.fd ? "CAN FD" : "classical CAN",
                        m.sender);
    text += "| byte | type | field | scale | unit | range |\n|---|---|---|---|---|---|\n";
    for (const WireField& f : m.fields)
      text += fmt::format("| {} | {}{} | {} | {:g} | {} | {:g}..{:g} |\n", f.offset,
                          f.is_signed ? 'i' : 'u', 8 * f.bytes, f.name, 1 / f.per_unit,
                          f.unit == "m|rad" ? "m or rad" : f.unit, f.is_signed ? -largest(f) : 0,
                          largest(f));
  }
  return text;
}

std::string dbc() {
  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: NcUnit";
  for (std::string_view name : kNodeNames) text += fmt::format(" {}", name);
  text += "\n\n";
  for_each_identifier([&](const WireMessage& m, int node) { append_message(text, m, node); });
  text +=
      "BA_DEF_ \"BusType\" STRING ;\n"
      "BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"ExtendedCAN\"";
  for (int i = 0; i < 12; ++i) text += ",\"reserved\"";
  text +=
      ",\"StandardCAN_FD\",\"ExtendedCAN_FD\";\n"
      "BA_DEF_ BO_ \"CANFD_BRS\" ENUM \"0\",\"1\";\n"
      "BA_DEF_DEF_ \"BusType\" \"CAN FD\";\n"
      "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n"
      "BA_DEF_DEF_ \"CANFD_BRS\" \"0\";\n"
      "BA_ \"BusType\" \"CAN FD\";\n";
  for_each_identifier([&](const WireMessage& m, int node) {
    if (!m.fd) return;
    text += fmt::format("BA_ \"VFrameFormat\" BO_ {} 14;\nBA_ \"CANFD_BRS\" BO_ {} 1;\n",
                        m.base + node, m.base + node);
  });
  return text;
}

}  // namespace vcnc
