// The message tables for people and for tools of others.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace vcnc {

/// A field of a message as the documentation shows it.
struct WireField {
  std::string_view name, unit;
  int offset = 0, bytes = 0;
  bool is_signed = false;
  double per_unit = 1;  ///< counts per unit
};

/// A message with its fields. `first_node`..`last_node`: the nodes that send it, each with its own
/// COB-ID base + node; both 0: one identifier, the base itself.
struct WireMessage {
  std::string_view name, sender;
  int base = 0, first_node = 0, last_node = 0;
  int length = 0;
  bool fd = false;
  std::vector<WireField> fields;
  bool to_node = false;  ///< from the NC unit to the node in the identifier
};

/// Every message on the bus, from the tables the codecs use.
std::vector<WireMessage> wire_messages();

/// The page docs/wire.md.
std::string wire_table_markdown();

/// The bus as a DBC file, with the attributes that mark CAN FD frames.
std::string dbc();

}  // namespace vcnc
