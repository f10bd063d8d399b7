#pragma once

// Assembles messages from the datagrams of an LCM multicast bus (udpm://), which anybody may send.
// LCM's own reassembly (1.3.1) writes to offsets that it did not check, so this class replaces it.
// There are two kinds of datagram:
//   short:    "LC02", number; channel, 0, data
//   fragment: "LC03", number, bytes of the message, offset of this piece, number of the fragment,
//             number of fragments; channel, 0 before the data of fragment 0
// Numbers are big-endian and have 32 bits; number and count of fragments have 16 bits.
//
// Every field is checked before it is used. A fragment takes as much memory as its own data,
// whatever size its header announces. Knows no socket, thread or clock.

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"

namespace pangea {

inline constexpr uint32_t kUdpmShortMagic = 0x4c433032;     // "LC02"
inline constexpr uint32_t kUdpmFragmentMagic = 0x4c433033;  // "LC03"
// Largest size of a short message: channel, 0 byte and data. LCM fragments larger messages.
inline constexpr size_t kMaxUdpmShortBytes = 65'499;

class UdpmAssembler {
 public:
  static constexpr size_t kMaxChannel = 63;  // bytes, LCM's limit
  static constexpr size_t kMaxMessage = 16 << 20;
  // Bounds on the incomplete messages of all senders together. Beyond them, the message that got no
  // fragment for the longest time is dropped.
  static constexpr size_t kMaxPartials = 1000;
  static constexpr size_t kMaxPartialBytes = 32 << 20;

  struct Message {
    std::string channel;
    Bytes data;  // points into the datagram or the assembler: valid until the next Take
  };

  // Returns the message that the datagram contains or completes, if any. `sender` identifies the
  // socket of the sender.
  std::optional<Message> Take(Bytes datagram, uint64_t sender);

  // Number of refused datagrams and messages, by reason.
  const std::map<std::string, int64_t>& refused() const { return refused_; }
  // Number and memory of the incomplete messages.
  size_t partials() const { return partials_.size(); }
  size_t partial_bytes() const { return partial_bytes_; }

 private:
  using Key = std::pair<uint64_t, uint32_t>;  // sender, number
  struct Fragment {
    uint32_t message_number = 0;
    uint32_t message_bytes = 0;
    uint32_t offset = 0;
    uint16_t number = 0;
    uint16_t count = 0;
    std::string channel;  // only in fragment 0
    Bytes data;
  };
  struct Piece {
    uint32_t offset = 0;
    std::vector<uint8_t> data;
  };
  struct Partial {
    Key key;
    uint32_t message_bytes = 0;
    uint16_t count = 0;
    std::string channel;
    size_t received_bytes = 0;
    size_t cost_bytes = 0;  // its share of kMaxPartialBytes
    std::map<uint16_t, Piece> pieces;
  };
  using Partials = std::list<Partial>;  // the one without new fragment for the longest time first

  std::nullopt_t Refuse(const char* reason);
  std::optional<Message> TakeShort(Bytes datagram);
  std::optional<Message> TakeFragment(Bytes datagram, uint64_t sender);
  std::optional<Fragment> ParseFragment(Bytes datagram);
  static bool Contradicts(const Partial& partial, const Fragment& fragment);
  Partials::iterator PartialOf(const Key& key, const Fragment& fragment);
  void Add(const Fragment& fragment, Partial* partial);
  std::optional<Message> Join(const Partial& partial);
  void Remove(Partials::iterator partial);
  void KeepWithinBounds();

  Partials partials_;
  std::map<Key, Partials::iterator> by_key_;
  size_t partial_bytes_ = 0;
  std::vector<uint8_t> joined_;
  std::map<std::string, int64_t> refused_;
};

}  // namespace pangea
