// whisker-pico-sim: the executed image of the Pico as a USB device: for a command under umockdev, or for a kernel by
// USB/IP.
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <stdexcept>

#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "child.h"
#include "usb_control.h"
#include "usbfs_server.h"
#include "usbip_server.h"

using namespace bridge_sim;

namespace
{

constexpr char PROGRAM[] = "whisker-pico-sim";
constexpr int WAIT_MS = 100; // to look after the command and the board

// What goes to the board's process, and what comes back; data of `bytes` follow (sim/pico/serve.mjs).
enum Kind : uint32_t { CONTROL, BULK, CANCEL, RESET };
struct Request {
    uint32_t kind, id, length, bytes;
    uint8_t setup[8];
};
struct Result {
    uint32_t id;
    int32_t status;
    uint32_t bytes;
};

volatile sig_atomic_t ending;

class Board
{
  public:
    explicit Board(char **words)
    {
        int to[2], from[2];
        if (pipe(to) != 0 || pipe(from) != 0 || (pid_ = fork()) < 0) {
            throw std::runtime_error("no process for the board");
        }
        if (pid_ == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            dup2(to[0], 3);
            dup2(from[1], 4);
            for (int descriptor = 5; descriptor < 64; descriptor++) {
                close(descriptor);
            }
            unsetenv("LD_PRELOAD"); // umockdev's is for the host's programs
            execvp(words[0], words);
            std::fprintf(stderr, "%s: %s: not found; run: apt-get install nodejs npm\n", PROGRAM, words[0]);
            _exit(127);
        }
        close(to[0]);
        close(from[1]);
        out_ = to[1];
        in_ = from[0];
    }
    ~Board()
    {
        kill(pid_, SIGKILL);
        waitpid(pid_, nullptr, 0);
    }
    void send(const Request &request, const Bytes &data) const
    {
        Bytes all(sizeof request + request.bytes);
        std::memcpy(all.data(), &request, sizeof request);
        std::copy_n(data.begin(), request.bytes, all.begin() + sizeof request);
        if (write(out_, all.data(), all.size()) != static_cast<ssize_t>(all.size())) {
            throw std::runtime_error("the board has ended");
        }
    }
    Result receive(Bytes &data) const
    {
        Result result;
        read_all(&result, sizeof result);
        data.resize(result.bytes);
        read_all(data.data(), data.size());
        return result;
    }
    int descriptor() const
    {
        return in_;
    }

  private:
    void read_all(void *to, size_t n) const
    {
        for (auto *at = static_cast<char *>(to); n > 0;) {
            const ssize_t got = read(in_, at, n);
            if (got <= 0) {
                throw std::runtime_error("the board has ended");
            }
            at += got;
            n -= static_cast<size_t>(got);
        }
    }
    pid_t pid_ = -1;
    int out_ = -1, in_ = -1;
};

Request request_of(const Urb &urb, uint32_t id)
{
    const SetupRequest &s = urb.setup;
    const bool control = urb.kind == UrbKind::CONTROL;
    const uint32_t bytes = control && !s.to_host() ? s.length : 0;
    const uint32_t length = static_cast<uint32_t>(urb.length);
    Request request = {control                          ? CONTROL
                       : urb.kind == UrbKind::BUS_RESET ? RESET
                                                        : BULK,
                       id,
                       length,
                       bytes,
                       {s.type, s.request}};
    const uint16_t words[] = {s.value, s.index, s.length};
    for (int i = 0; i < 6; i++) {
        request.setup[2 + i] = static_cast<uint8_t>(words[i / 2] >> 8 * (i % 2));
    }
    return request;
}

class Bridge
{
  public:
    Bridge(Board &board, DevicePort &port) : board_(board), port_(port)
    {
        Descriptors descriptors;
        const char *error = nullptr;
        const auto transfer = [this](const SetupRequest &setup, Bytes &data) { return exchange(setup, data); };
        if (!configure(transfer, descriptors, error)) {
            throw std::runtime_error(std::string("the board was not enumerated: ") + error);
        }
        descriptors.product = text(2);
        descriptors.serial = text(3);
        port_.plug(descriptors);
    }
    void step()
    {
        pollfd waits[] = {{port_.wake_descriptor(), POLLIN, 0}, {board_.descriptor(), POLLIN, 0}};
        poll(waits, 2, WAIT_MS);
        std::vector<Urb> ended;
        for (DeviceRequest &request : port_.take_requests()) {
            request.discard ? discard(request.urb, ended) : submit(request.urb);
        }
        while (poll(waits + 1, 1, 0) == 1) {
            Bytes data;
            const Result result = board_.receive(data);
            const auto found = open_.find(result.id);
            if (found != open_.end()) {
                Urb &urb = found->second;
                urb.status = result.status;
                if (urb.kind != UrbKind::CONTROL || urb.setup.to_host()) {
                    urb.data = data; // else it stays what the host sent
                }
                ended.push_back(urb);
                open_.erase(found);
            }
        }
        if (!ended.empty()) {
            port_.deliver(std::move(ended));
        }
    }

  private:
    // A string of the board, of letters that ASCII has.
    std::string text(uint8_t index)
    {
        Bytes data(UINT8_MAX);
        std::string out;
        exchange({0x80, 6, static_cast<uint16_t>(0x0300 | index), 0x0409, UINT8_MAX}, data);
        for (size_t i = 2; i < data.size(); i += 2) {
            out += static_cast<char>(data[i]);
        }
        return out;
    }
    // SET_ADDRESS is the board's host's own: it has given one.
    Outcome exchange(const SetupRequest &setup, Bytes &data)
    {
        if (setup.type == 0 && setup.request == 5) {
            return Outcome::OK;
        }
        Urb urb;
        urb.setup = setup;
        board_.send(request_of(urb, 0), data);
        return board_.receive(data).status == 0 ? Outcome::OK : Outcome::STALL;
    }
    // The interrupt endpoint never says anything: its transfer stays open.
    void submit(const Urb &urb)
    {
        const uint32_t id = next_++;
        open_[id] = urb;
        if (urb.kind != UrbKind::INTERRUPT_IN) {
            board_.send(request_of(urb, id), urb.data);
        }
    }
    void discard(const Urb &urb, std::vector<Urb> &ended)
    {
        for (auto at = open_.begin(); at != open_.end(); ++at) {
            if (at->second.id == urb.id) {
                board_.send({CANCEL, at->first, 0, 0, {}}, {});
                at->second.status = -ENOENT;
                at->second.data.clear();
                ended.push_back(at->second);
                open_.erase(at);
                return;
            }
        }
    }
    Board &board_;
    DevicePort &port_;
    std::map<uint32_t, Urb> open_;
    uint32_t next_ = 1;
};

int run(int argc, char **argv)
{
    const bool usbip = argc > 2 && std::strcmp(argv[1], "--usbip") == 0;
    char **words = argv + (usbip ? 3 : 1);
    char **command = words;
    while (*command && std::strcmp(*command, "--") != 0) {
        command++;
    }
    if (!*words || (*command != nullptr) == usbip) {
        std::fprintf(stderr,
                     "Usage: %s [--usbip PORT] BOARD-WORD... [-- COMMAND...]; see whisker bridge-sim --board pico\n",
                     PROGRAM);
        return 2;
    }
    const std::vector<std::string> host(usbip ? command : command + 1, argv + argc);
    *command = nullptr;
    Board board(words);
    std::unique_ptr<DevicePort> port;
    if (usbip) {
        auto server = std::make_unique<UsbipServer>(static_cast<uint16_t>(std::strtoul(argv[2], nullptr, 10)));
        std::printf("serving usbip at 127.0.0.1:%u\n", server->port());
        std::fflush(stdout);
        port = std::move(server);
    } else {
        port = std::make_unique<UsbfsServer>();
    }
    Bridge bridge(board, *port);
    const auto child = usbip ? nullptr : std::make_unique<Child>(host);
    for (bool asked = false; usbip ? !ending : !child->ended(); bridge.step()) {
        if (ending && child && !asked) {
            child->ask_to_end();
            asked = true;
        }
    }
    return usbip ? 0 : child->exit_code();
}

} // namespace

int main(int argc, char **argv)
{
    signal(SIGPIPE, SIG_IGN);
    for (const int number : {SIGINT, SIGTERM}) {
        signal(number, [](int) { ending = 1; });
    }
    try {
        return run(argc, argv);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s: %s\n", PROGRAM, error.what());
        return 1;
    }
}
