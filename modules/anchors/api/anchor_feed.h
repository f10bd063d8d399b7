#pragma once

// The changes of anchors, for clients on a WebSocket. Only the newest state of each anchor is kept,
// so a slow client skips intermediate states and needs no queue. Bounded by the number of anchors.
//
// The owner sets the time. Anchors are compared every kInterval_us, and only while a client is
// connected.

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "anchors/anchors.h"
#include "anchors/api/anchor_json.h"
#include "web/web_site.h"

namespace pangea {

class AnchorFeed {
 public:
  static constexpr int64_t kInterval_us = 200'000;

  // `anchors` must outlive it.
  explicit AnchorFeed(const Anchors& anchors) : anchors_(anchors) {}

  void SetNow(int64_t now_utime) { now_utime_ = now_utime; }

  // The first change after version `seen`. Deletions up to version `since` are left out.
  struct Change {
    int64_t version = 0;
    std::string json;
  };
  std::optional<Change> After(int64_t seen, int64_t since);
  int64_t version() const { return version_; }

 private:
  struct Entry {
    int64_t version = 0;
    std::optional<ListedAnchor> newest;  // empty: gone
  };

  void Refresh();
  static bool IsOther(const ListedAnchor& a, const ListedAnchor& b);
  void Set(const AnchorId& id, std::optional<ListedAnchor> newest);

  const Anchors& anchors_;
  int64_t now_utime_ = 0;
  int64_t next_utime_ = 0;
  int64_t version_ = 0;
  std::map<AnchorId, Entry> entries_;
  std::map<int64_t, AnchorId> by_version_;  // newest version of each anchor
};

// One client: is sent all anchors first, then the changes.
class AnchorListener : public web::WebPeer {
 public:
  explicit AnchorListener(AnchorFeed& feed) : feed_(feed), since_(feed.version()) {}

  bool is_text() const override { return true; }
  std::optional<std::vector<uint8_t>> Next() override;
  // The client must not send anything: closes the connection.
  bool Receive(std::string_view) override { return false; }

 private:
  AnchorFeed& feed_;
  const int64_t since_;
  int64_t seen_ = 0;
};

}  // namespace pangea
