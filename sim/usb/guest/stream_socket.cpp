#include "stream_socket.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace bridge_sim
{

namespace
{

constexpr int BACKLOG = 8;

void set_option(int socket, int level, int name)
{
    const int on = 1;
    setsockopt(socket, level, name, &on, sizeof on);
}

bool would_block()
{
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

} // namespace

Descriptor::Descriptor(int number) : number_(number)
{
}

Descriptor::~Descriptor()
{
    if (number_ >= 0) {
        close(number_);
    }
}

Descriptor::Descriptor(Descriptor &&other) noexcept : number_(other.number_)
{
    other.number_ = -1;
}

Descriptor &Descriptor::operator=(Descriptor &&other) noexcept
{
    std::swap(number_, other.number_);
    return *this;
}

int Descriptor::get() const
{
    return number_;
}

// -------------------------------------------------------------------------------------------------------------- waker

Waker::Waker() : epoll_(epoll_create1(EPOLL_CLOEXEC))
{
}

int Waker::descriptor() const
{
    return epoll_.get();
}

void Waker::watch(int descriptor, bool writing)
{
    epoll_event event{};
    event.events = writing ? EPOLLIN | EPOLLOUT : EPOLLIN;
    event.data.fd = descriptor;
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, descriptor, &event) != 0) {
        epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event);
    }
}

// ----------------------------------------------------------------------------------------------------------- listener

Listener::Listener(uint16_t port, Waker &waker)
    : socket_(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0))
{
    sockaddr_in address{};
    socklen_t size = sizeof address;
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    set_option(socket_.get(), SOL_SOCKET, SO_REUSEADDR);
    auto *generic = reinterpret_cast<sockaddr *>(&address);
    if (bind(socket_.get(), generic, size) != 0 || ::listen(socket_.get(), BACKLOG) != 0 ||
        getsockname(socket_.get(), generic, &size) != 0) {
        throw std::runtime_error("port " + std::to_string(port) + " of 127.0.0.1 cannot be listened on (" +
                                 std::strerror(errno) + "): give another");
    }
    port_ = ntohs(address.sin_port);
    waker.watch(socket_.get(), false);
}

uint16_t Listener::port() const
{
    return port_;
}

std::optional<Descriptor> Listener::accept()
{
    Descriptor accepted(::accept4(socket_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (accepted.get() < 0) {
        return std::nullopt;
    }
    set_option(accepted.get(), IPPROTO_TCP, TCP_NODELAY);
    return accepted;
}

// ------------------------------------------------------------------------------------------------------------- stream

Stream::Stream(Descriptor socket, Waker &waker) : socket_(std::move(socket)), waker_(waker)
{
    waker_.watch(socket_.get(), false);
}

size_t Stream::receive(uint8_t *bytes, size_t most)
{
    const ssize_t count = recv(socket_.get(), bytes, most, 0);
    ended_ = ended_ || (most > 0 && count == 0) || (count < 0 && !would_block());
    return count > 0 ? static_cast<size_t>(count) : 0;
}

size_t Stream::send(const uint8_t *bytes, size_t count)
{
    const ssize_t sent = ::send(socket_.get(), bytes, count, MSG_NOSIGNAL);
    ended_ = ended_ || (sent < 0 && !would_block());
    const size_t went = sent > 0 ? static_cast<size_t>(sent) : 0;
    if ((went < count) != writing_) {
        writing_ = went < count;
        waker_.watch(socket_.get(), writing_);
    }
    return went;
}

void Stream::send_all(const Bytes &bytes)
{
    unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
    flush();
}

void Stream::flush()
{
    if (!unsent_.empty()) {
        const size_t went = send(unsent_.data(), unsent_.size());
        unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<Bytes::difference_type>(went));
    }
}

bool Stream::ended() const
{
    return ended_;
}

} // namespace bridge_sim
