// Seeds for the fuzz targets, from a captured session: make_corpus LOG CORPUS_FOLDER
//
// The seeds are real messages, with keyframes cut down to a few corners. So they are small enough
// for a repository, and mutations hit fields, not descriptors.

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <set>

#include "agent_handler/agent_handler.h"
#include "agent_handler/journal/journal.h"
#include "bus/transport/test_datagrams.h"
#include "core/big_endian.h"
#include "corpus.h"
#include "files/text_file.h"
#include "fuzz.h"
#include "link/compression.h"
#include "link_channels.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea_schemas.h"
#include "sensor_channels.h"
#include "server_channels.h"
#include "uplink/spool.h"
#include "uplink/uplink.h"

namespace pangea::fuzz {
namespace {

namespace fs = std::filesystem;
using Payload = std::vector<uint8_t>;

constexpr size_t kCorners = 12;
constexpr size_t kPoints = 4;

struct Captured {
  std::string channel;
  Payload data;
};

Payload Small(const Payload& keyframe_bytes, size_t corners) {
  KeyframeMessage message{};
  Require(DecodeMessage(keyframe_bytes, &message), "the log's keyframes decode");
  Keyframe keyframe = *Parse(message).value;
  keyframe.corners.resize(std::min(keyframe.corners.size(), corners));
  std::erase_if(keyframe.points, [&](const MapPoint& point) {
    return point.corner >= static_cast<int>(keyframe.corners.size());
  });
  keyframe.points.resize(std::min(keyframe.points.size(), kPoints));
  return EncodeMessage(ToMessage(keyframe));
}

Payload SmallState(const Payload& bytes) {
  map_state_t message{};
  Require(DecodeMessage(bytes, &message), "the log's map states decode");
  message.keyframes.resize(std::min<size_t>(message.keyframes.size(), 4));
  message.num_keyframes = static_cast<int16_t>(message.keyframes.size());
  return EncodeMessage(message);
}

std::vector<Captured> ReadSmall(const std::string& log) {
  std::vector<Captured> events;
  ReadLog(log, [&](const LogEvent& event) {
    Payload data(event.data.begin(), event.data.end());
    if (event.channel.starts_with("KEYFRAME_")) {
      data = Small(data, kCorners);
    } else if (event.channel == "MAP_STATE") {
      data = SmallState(data);
    }
    events.push_back({event.channel, std::move(data)});
  });
  return events;
}

const Payload& First(const std::vector<Captured>& events, const std::string& channel,
                     int skip = 0) {
  for (const Captured& event : events) {
    if (event.channel == channel && skip-- == 0) {
      return event.data;
    }
  }
  throw std::runtime_error("the log has too little on " + channel);
}

Payload Landmarks(const MapId& map) {
  MapLandmarks landmarks{map, map, 3, {{{map, 1}, {0, 0, 1}}}, {}};
  landmarks.landmarks.push_back({0, 7, {1, 2, 3}, 0.1, 0.01, {}});
  return EncodeMessage(ToMessage(landmarks));
}

Payload Results(const MapId& map) {
  verdict_request_t request{};
  request.requester = "posegraph";
  request.map = ToMessage(map);
  request.num_verdicts = 1;
  request.seq = {1};
  request.constraint_id = {7};
  return EncodeMessage(request);
}

MapId MapOf(const Payload& keyframe_bytes) {
  KeyframeMessage message{};
  DecodeMessage(keyframe_bytes, &message);
  return Parse(message.id).value->map;
}

// Datagrams of two senders in turn, and malformed ones, which every receiver must refuse.
void Datagrams(const Corpus& corpus) {
  const std::string name = "A" + std::string(1, '\0'), data(50, 'x');
  Payload whole, malformed;
  AppendStep(0, ShortDatagram(name + data), &whole);
  for (const uint16_t number : {0, 2, 1}) {
    const FragmentHeader header{7, 150, 50U * number, number, 3};
    for (const int sender : {1, 2}) {
      AppendStep(sender, FragmentDatagram(header, (number == 0 ? name : "") + data), &whole);
    }
  }
  for (Datagram& datagram : MalformedDatagrams("A")) {
    datagram.resize(std::min<size_t>(datagram.size(), 100));
    AppendStep(0, datagram, &malformed);
  }
  corpus.Add("datagram", "whole", whole);
  corpus.Add("datagram", "malformed", malformed);
}

// Seeds in the order of fuzz_messages.cc.
void Messages(const std::vector<Captured>& events, const Corpus& corpus) {
  const Payload& first = First(events, "KEYFRAME_1");
  KeyframeMessage keyframe{};
  DecodeMessage(first, &keyframe);
  const MapId map = MapOf(first);
  LinkAck ack{1, 9, 100'000, {{map, 3}}, {{{map, 4}, {7}}}, {}};
  correction_t correction{};
  DecodeMessage(First(events, "CORRECTION_1"), &correction);
  ack.corrections.push_back(*Parse(correction).value);
  pose_t pose{};
  DecodeMessage(First(events, "POSE_1", 50), &pose);
  const std::vector<std::pair<std::string, Payload>> seeds = {
      {"camera", EncodeMessage(keyframe.camera)},
      {"place_match", First(events, "PLACE_MATCH", 40)},
      {"constraint", First(events, "CONSTRAINT")},
      {"correction", First(events, "CORRECTION_1")},
      {"map_state", First(events, "MAP_STATE")},
      {"have", First(events, "HAVE", 5)},
      {"resend_request", First(events, "RESEND_REQUEST")},
      {"hello", Encode(LinkHello{"software", {{map, 0, 0, 1}}})},
      {"ack", Encode(ack)},
      {"pose", EncodePose(pose)},
      {"compressed", Compress(first)},
      {"landmarks", Landmarks(map)},
      {"verdict_request", Results(map)},
  };
  for (size_t i = 0; i < seeds.size(); ++i) {
    Payload bytes{static_cast<uint8_t>(i)};
    bytes.insert(bytes.end(), seeds[i].second.begin(), seeds[i].second.end());
    corpus.Add("messages", seeds[i].first, bytes);
  }
}

// One message of each type in the log, with the type's index in LcmSchemas.
void Fields(const std::vector<Captured>& events, const Corpus& corpus) {
  const std::vector<LcmSchema> schemas = LcmSchemas();
  std::set<int64_t> taken;
  for (const Captured& event : events) {
    const auto fingerprint = static_cast<int64_t>(
        GetBigEndian(event.data.data(), std::min<size_t>(8, event.data.size())));
    const auto schema = std::find_if(schemas.begin(), schemas.end(), [&](const LcmSchema& known) {
      return known.fingerprint == fingerprint;
    });
    if (schema != schemas.end() && taken.insert(fingerprint).second) {
      Payload bytes{static_cast<uint8_t>(schema - schemas.begin())};
      bytes.insert(bytes.end(), event.data.begin(), event.data.end());
      corpus.Add("fields", event.channel, bytes);
    }
  }
}

// The packets that each end of a working link receives.
void Link(const std::vector<Captured>& events, const Corpus& corpus) {
  Uplink uplink{UplinkOptions{}};
  AgentHandler handler(1, ReceiverOptions{});
  Payload to_uplink, to_handler;
  const auto to = [](const std::vector<Channel>& table, const std::string& channel, Bytes data,
                     Payload* sequence) { AppendStep(Find(table, channel), data, sequence); };
  int64_t now_us = 1'000'000;
  const auto run = [&](int rounds) {
    for (int i = 0; i < rounds; ++i, now_us += 30'000) {
      for (const LinkPacket& packet : uplink.Poll(now_us)) {
        to(HandlerChannels(), ChannelOfKind(packet.kind), packet.body, &to_handler);
        handler.OnPacket(packet);
      }
      for (const Receiver::Keyframe& keyframe : handler.TakeReady()) {
        handler.Journalled(keyframe.id);
      }
      if (const auto ack = handler.TakeAck(now_us)) {
        to(UplinkChannels(), "ACK", Encode(*ack), &to_uplink);
        uplink.OnAck(*ack, now_us);
      }
    }
  };
  handler.OnNewUplink();
  for (int seq = 0; seq < 2; ++seq) {
    const Payload& bytes = First(events, "KEYFRAME_1", seq);
    KeyframeMessage message{};
    DecodeMessage(bytes, &message);
    to(UplinkChannels(), "KEYFRAME_1", bytes, &to_uplink);
    uplink.AddKeyframe(*Parse(message.id).value, Compress(bytes), now_us);
    run(20);
  }
  for (const char* channel : {"PLACE_MATCH", "CORRECTION_1", "RESEND_REQUEST"}) {
    to(HandlerChannels(), channel, First(events, channel), &to_handler);
  }
  to(UplinkChannels(), "POSE_1", First(events, "POSE_1", 50), &to_uplink);
  const Payload landmarks = Landmarks(MapOf(First(events, "KEYFRAME_1")));
  to(HandlerChannels(), "LANDMARKS_1", landmarks, &to_handler);
  to(UplinkChannels(), "LANDMARKS", landmarks, &to_uplink);
  corpus.Add("agent_handler", "link", to_handler);
  corpus.Add("uplink", "link", to_uplink);
}

void Journals(const std::vector<Captured>& events, const Corpus& corpus) {
  const fs::path file = ScratchFolder() / "made.lcm";
  fs::remove(file);
  {
    Journal journal(file.string(),
                    [](const std::string&, Bytes, const JournalPlace&) { return true; });
    for (int seq = 0; seq < 2; ++seq) {
      journal.Append(seq, "KEYFRAME_1", First(events, "KEYFRAME_1", seq));
    }
    journal.Append(2, "PLACE_MATCH", First(events, "PLACE_MATCH"));
    journal.Append(3, "CONSTRAINT", First(events, "CONSTRAINT"));
  }
  const std::string text = ReadTextFile(file);
  corpus.AddText("journal", "whole", text);
  corpus.AddText("journal", "torn", text.substr(0, text.size() - 100));
}

void Spools(const std::vector<Captured>& events, const Corpus& corpus) {
  const fs::path folder = ScratchFolder() / "made";
  {
    Spool spool(folder, 1, 1 << 20);
    for (int seq = 0; seq < 2; ++seq) {
      const Payload& bytes = First(events, "KEYFRAME_1", seq);
      spool.Add({MapOf(bytes), seq}, bytes, seq);
    }
  }
  const std::string text = ReadTextFile(fs::directory_iterator(folder)->path());
  corpus.AddText("spool", "whole", text);
  corpus.AddText("spool", "torn", text.substr(0, text.size() - 100));
}

// A camera of 32 x 24 pixels: stationary, then moving.
void Sensors(const Corpus& corpus) {
  CameraModel camera;
  camera.width = 32;
  camera.height = 24;
  camera.fx = camera.fy = 30;
  camera.cx = 16;
  camera.cy = 12;
  Payload sequence;
  AppendStep(0, EncodeMessage(ToMessage(camera)), &sequence);
  for (int frame = 0; frame < 4; ++frame) {
    image_t image{};
    image.utime = 1'000'000 + 50'000 * frame;
    image.encoding = image_t::ENCODING_RAW8;
    image.width = camera.width;
    image.height = camera.height;
    image.num_chunks = 2;
    image.total_bytes = camera.width * camera.height;
    image.num_bytes = static_cast<int16_t>(image.total_bytes / 2);
    for (int chunk = 0; chunk < 2; ++chunk) {
      image.chunk = static_cast<int16_t>(chunk);
      image.offset_bytes = chunk * image.num_bytes;
      image.data.resize(static_cast<size_t>(image.num_bytes));
      for (size_t i = 0; i < image.data.size(); ++i) {
        image.data[i] = static_cast<uint8_t>((i / 5 + static_cast<size_t>(frame)) % 4 * 60);
      }
      AppendStep(2, EncodeMessage(image), &sequence);
    }
    imu_t imu{};
    imu.utime = image.utime + 10;
    imu.accel_body.z = 9.81;
    AppendStep(1, EncodeMessage(imu), &sequence);
  }
  corpus.Add("live_input", "camera", sequence);
}

// A keyframe, and an anchor on a pixel of it and one in its frame.
void Anchors(const Payload& keyframe_bytes, const Corpus& corpus) {
  KeyframeMessage keyframe{};
  Require(DecodeMessage(keyframe_bytes, &keyframe), "the log's keyframes decode");
  Payload sequence;
  AppendStep(Find(ServerChannels(), "KEYFRAME_1"), keyframe_bytes, &sequence);
  for (int seq = 0; seq < 2; ++seq) {
    AnchorEdit edit;
    edit.anchor = {1, 10 + seq};
    edit.agent_id = 1;
    edit.right = AnchorRight::kEditOwn;
    edit.seq = seq;
    edit.name = "kettle";
    edit.placement = seq == 0 ? AnchorEdit::Placement::kPixel : AnchorEdit::Placement::kKeyframe;
    edit.map = Parse(keyframe.id).value->map;
    edit.keyframe_seq = keyframe.id.seq;
    edit.utime = keyframe.utime;
    edit.pixel = {300, 200};
    AppendStep(Find(ServerChannels(), "ANCHOR_EDIT"), EncodeMessage(ToMessage(edit)), &sequence);
  }
  corpus.Add("server", "anchors", sequence);
}

void Server(const std::vector<Captured>& events, const Corpus& corpus) {
  constexpr size_t kMaxBytes = 16'000;
  std::map<std::string, int> taken;
  Payload sequence;
  for (const Captured& event : events) {
    const int channel = Find(ServerChannels(), event.channel);
    const int limit = event.channel.starts_with("KEYFRAME_") ? 3 : 2;
    if (channel >= 0 && taken[event.channel]++ < limit && sequence.size() < kMaxBytes) {
      AppendStep(channel, event.data, &sequence);
    }
  }
  corpus.Add("server", "session", sequence);
  Anchors(First(events, "KEYFRAME_1"), corpus);
}

int Make(const std::string& log, const Corpus& corpus) {
  const std::vector<Captured> events = ReadSmall(log);
  corpus.Add("keyframe", "first", First(events, "KEYFRAME_1"));
  corpus.Add("keyframe", "second", First(events, "KEYFRAME_2", 1));
  corpus.Add("keyframe", "bare", Small(First(events, "KEYFRAME_1", 1), 0));
  Datagrams(corpus);
  Messages(events, corpus);
  Fields(events, corpus);
  Link(events, corpus);
  Journals(events, corpus);
  Spools(events, corpus);
  AddTexts(corpus);
  Sensors(corpus);
  Server(events, corpus);
  return 0;
}

}  // namespace
}  // namespace pangea::fuzz

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: pangea-fuzz-corpus LOG CORPUS_FOLDER\n");
    return 2;
  }
  try {
    return pangea::fuzz::Make(argv[1], pangea::fuzz::Corpus(argv[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pangea-fuzz-corpus: %s\n", error.what());
    return 1;
  }
}
