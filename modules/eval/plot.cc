#include "eval/plot.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "files/text_file.h"

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX leaves it to the user

namespace pangea {
namespace {

// A gnuplot string literal: in single quotes only the quote itself is special.
std::string Quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "''" : std::string(1, c);
  }
  return quoted + "'";
}

// Size in pixels; with equal axes the picture has the shape of the data.
Eigen::Vector2i CanvasSize(const Plot& plot) {
  constexpr int kWidth = 1400;
  constexpr int kMargins = 150;  // title, legend, axis labels
  constexpr int kSides = 165;    // the y axis' numbers and label, a margin
  Eigen::AlignedBox2d box;
  for (const PlotLine& line : plot.lines) {
    for (const Eigen::Vector2d& p : line.points) {
      if (p.allFinite()) {
        box.extend(p);
      }
    }
  }
  if (!plot.equal_axes || box.isEmpty() || box.sizes().x() <= 0) {
    return {kWidth, plot.height};
  }
  const double height = (kWidth - kSides) * std::min(box.sizes().y() / box.sizes().x(), 10.0);
  return {kWidth, std::clamp(static_cast<int>(height), 400, 1200) + kMargins};
}

std::string NamedTics(const std::vector<std::string>& names) {
  std::string tics;
  for (size_t i = 0; i < names.size(); ++i) {
    tics += fmt::format("{}{} {}", tics.empty() ? "" : ", ", Quoted(names[i]), i + 1);
  }
  return names.empty() ? ""
                       : fmt::format("set ytics ({})\nset yrange [0.4:{}.6]\n", tics, names.size());
}

std::string Script(const Plot& plot, const std::string& path) {
  std::string script;
  for (size_t i = 0; i < plot.lines.size(); ++i) {
    script += fmt::format("$line{} << EOD\n", i);
    for (const Eigen::Vector2d& p : plot.lines[i].points) {
      script += p.allFinite() ? fmt::format("{:.6f} {:.6f}\n", p.x(), p.y()) : "\n";
    }
    script += "EOD\n";
  }
  const Eigen::Vector2i size = CanvasSize(plot);
  script += fmt::format(
      "set terminal pngcairo noenhanced size {},{} font 'sans,14' background '#ffffff'\n"
      "set border 3 linecolor '#555555'\nset tics nomirror textcolor '#333333'\n"
      "set grid linetype 1 linecolor '#e4e4e4' linewidth 1\n"
      "set key tmargin center horizontal samplen 2\n"
      "set lmargin 11\nset rmargin 5\n",
      size.x(), size.y());
  script +=
      fmt::format("set output {}\nset title {} font ',17'\nset xlabel {}\nset ylabel {}\n",
                  Quoted(path), Quoted(plot.title), Quoted(plot.x_label), Quoted(plot.y_label));
  if (plot.equal_axes) {
    script +=
        "set size ratio -1\nset autoscale fix\n"
        "set offsets graph 0.03, graph 0.03, graph 0.03, graph 0.03\n";
  }
  if (plot.y_from_zero) {
    script += "set yrange [0:*]\n";
  }
  script += NamedTics(plot.y_names);
  std::string commands;
  for (size_t i = 0; i < plot.lines.size(); ++i) {
    const PlotLine& line = plot.lines[i];
    if (std::ranges::none_of(line.points, [](const auto& p) { return p.allFinite(); })) {
      continue;
    }
    commands += fmt::format("{}$line{} with lines linewidth {:.1f} linecolor '{}' dashtype {} {}",
                            commands.empty() ? "plot " : ", ", i, line.width, line.colour,
                            line.dashed ? 2 : 1,
                            line.label.empty() ? "notitle" : "title " + Quoted(line.label));
    if (line.mark_start) {
      commands += fmt::format(
          ", $line{} every ::0:0:0:0 with points pointtype 7 pointsize 1.6 linecolor '{}' notitle",
          i, line.colour);
    }
  }
  if (commands.empty()) {  // an empty plot is a picture that says so
    commands =
        "set xrange [0:1]\nset yrange [0:1]\nset label 'no data' at 0.5,0.5 center\n"
        "plot NaN notitle";
  }
  return script + commands + "\n";
}

// An unnamed file in memory, which exists as long as its descriptor is open.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : fd_(memfd_create(name, MFD_CLOEXEC)) {
    if (fd_ < 0) {
      throw std::runtime_error(fmt::format("memfd_create: {}", std::strerror(errno)));
    }
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int fd() const { return fd_; }
  void Write(const std::string& text) const {
    for (size_t done = 0; done < text.size();) {
      const ssize_t n = write(fd_, text.data() + done, text.size() - done);
      if (n < 0) {
        throw std::runtime_error(fmt::format("write: {}", std::strerror(errno)));
      }
      done += static_cast<size_t>(n);
    }
    lseek(fd_, 0, SEEK_SET);
  }
  std::string Read() const {
    lseek(fd_, 0, SEEK_SET);
    std::string text;
    std::array<char, 4096> buffer;
    for (ssize_t n = 0; (n = read(fd_, buffer.data(), buffer.size())) > 0;) {
      text.append(buffer.data(), static_cast<size_t>(n));
    }
    return text;
  }

 private:
  int fd_;
};

// `what`: for the error message.
void RunGnuplot(const std::string& commands, const std::string& what) {
  const MemoryFile script("gnuplot script");
  const MemoryFile complaints("gnuplot stderr");
  script.Write(commands);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, script.fd(), STDIN_FILENO);
  // If gnuplot may not write a file, it prints an error, and writes the picture to stdout.
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, complaints.fd(), STDERR_FILENO);
  std::array<char*, 2> argv = {const_cast<char*>("gnuplot"), nullptr};
  pid_t pid = 0;
  const int error = posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw std::runtime_error(
        fmt::format("{}: cannot be drawn, gnuplot does not start ({}); install gnuplot-nox", what,
                    std::strerror(error)));
  }
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error(fmt::format("{}: gnuplot failed: {}", what, complaints.Read()));
  }
}

}  // namespace

std::string AgentColour(size_t index) {
  constexpr std::array<const char*, 7> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                   "#e69f00", "#56b4e9", "#000000"};
  return kColours[index % kColours.size()];
}

// gnuplot does not report a full disk, so the file is checked.
void WritePng(const Plot& plot, const std::string& path) {
  RunGnuplot(Script(plot, path), path);
  if (!ReadTextFile(path).ends_with(std::string_view("IEND\xae\x42\x60\x82"))) {
    throw std::runtime_error(fmt::format("{}: the picture is cut off; is the disk full?", path));
  }
}

}  // namespace pangea
