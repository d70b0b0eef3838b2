//! Connections: the page itself, and its WebSocket.
//!
//! Any site that a browser shows may send requests to this machine. So a request has to name this
//! server as its host, under which no other site can be known, may not come from another origin, and
//! brings the token of the printed address.

use super::Shared;
use super::desk::Page;
use super::locked;
use super::outbox::Letter;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::Duration;
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

/// The most bytes of a request's head. A browser's has about one thousand.
const MOST_HEAD: usize = 1 << 14;

/// The most bytes of a page's message: some options.
const MOST_MESSAGE: usize = 1 << 16;

/// How long a request's head may take, and a page that reads nothing may block its writer.
const PATIENCE: Duration = Duration::from_secs(10);

const PAGE: &str = include_str!("../page.html");
const SCRIPT: [&str; 2] = [include_str!("../camera.js"), include_str!("../page.js")];
const STYLE: &str = include_str!("../page.css");

/// Who may connect.
pub struct Guard {
    address: SocketAddr,
    token: String,
}

/// The head of a request, as far as it counts.
struct Request {
    is_get: bool,
    path: String,
    token: String,
    host: String,
    origin: Option<String>,
    /// Whether the browser says that a script or element of another site asks.
    is_foreign: bool,
    /// The key of a WebSocket.
    key: Option<String>,
}

impl Guard {
    pub fn new(address: SocketAddr) -> Guard {
        Guard {
            address,
            token: token(),
        }
    }

    /// Returns the address of the page, with its token.
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.address, self.token)
    }

    /// Says what is wrong with a request, if anything is.
    fn refuse(&self, request: &Request) -> Option<&'static str> {
        if !self.is_host(&request.host) {
            return Some("this server is not known by that name; take the address that it printed");
        }
        let own = format!("http://{}", request.host);
        let is_own = request.origin.as_ref().is_none_or(|origin| *origin == own);
        if !is_own || request.is_foreign {
            return Some("another site may not ask this server");
        }
        match same(&request.token, &self.token) {
            true => None,
            false => {
                Some("the token is missing or wrong; take the address that the command printed")
            }
        }
    }

    /// Says whether a host, with any port (ssh may forward another), is this machine.
    fn is_host(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
            _ => host,
        };
        if name.eq_ignore_ascii_case("localhost") {
            return true;
        }
        let name = name.trim_start_matches('[').trim_end_matches(']');
        match name.parse::<IpAddr>() {
            // A name could be another site's by its own choice; a number cannot.
            Ok(ip) => {
                ip.is_loopback() || ip == self.address.ip() || self.address.ip().is_unspecified()
            }
            Err(_) => false,
        }
    }
}

/// Returns 128 random bits, as the system gives them to each table of hashes.
fn token() -> String {
    use std::hash::{BuildHasher, RandomState};
    let word = || RandomState::new().hash_one(std::process::id());
    format!("{:016x}{:016x}", word(), word())
}

/// Compares in a time that does not tell where texts differ.
fn same(a: &str, b: &str) -> bool {
    let differ = a
        .bytes()
        .zip(b.bytes())
        .fold(0, |all, (a, b)| all | (a ^ b));
    a.len() == b.len() && differ == 0
}

/// Serves one connection. What goes wrong with it concerns nobody else.
pub fn serve(mut stream: TcpStream, shared: &Arc<Shared>) {
    let _ = stream.set_nodelay(true);
    let _ = stream.set_read_timeout(Some(PATIENCE));
    let _ = stream.set_write_timeout(Some(PATIENCE));
    let Ok(request) = read_request(&mut stream) else {
        let _ = answer(
            &mut stream,
            "400 Bad Request",
            "text/plain",
            "not a request of HTTP\n",
        );
        return;
    };
    if let Some(why) = shared.guard.refuse(&request) {
        let _ = answer(
            &mut stream,
            "403 Forbidden",
            "text/plain",
            &format!("{why}\n"),
        );
        return;
    }
    let _ = match (request.is_get, &*request.path, &request.key) {
        (true, "/", _) => answer(&mut stream, "200 OK", "text/html; charset=utf-8", &page()),
        (true, "/ws", Some(key)) => talk(stream, key, shared),
        (true, _, _) => answer(
            &mut stream,
            "404 Not Found",
            "text/plain",
            "there is only a page\n",
        ),
        (false, _, _) => answer(
            &mut stream,
            "405 Method Not Allowed",
            "text/plain",
            "only GET\n",
        ),
    };
}

/// Returns the page with its script and style in it.
fn page() -> String {
    let page = PAGE.replace("/*STYLE*/", STYLE);
    page.replace("/*SCRIPT*/", &SCRIPT.concat())
}

fn read_request(stream: &mut TcpStream) -> Result<Request> {
    let bad = |what: &str| Error::new(ErrorKind::InvalidData, what.to_owned());
    let mut head = Vec::new();
    // Byte by byte, so that nothing of what follows the head is taken.
    let mut byte = [0];
    while !head.ends_with(b"\r\n\r\n") {
        if head.len() >= MOST_HEAD || stream.read(&mut byte)? == 0 {
            return Err(bad("head"));
        }
        head.push(byte[0]);
    }
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut parsed = httparse::Request::new(&mut headers);
    parsed.parse(&head).map_err(|e| bad(&e.to_string()))?;
    let target = parsed.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let token = query
        .split('&')
        .find_map(|pair| pair.strip_prefix("token="));
    let all = |name: &str| -> Vec<String> {
        let named = parsed
            .headers
            .iter()
            .filter(|h| h.name.eq_ignore_ascii_case(name));
        named
            .map(|h| String::from_utf8_lossy(h.value).into_owned())
            .collect()
    };
    let one = |name: &str| match &mut *all(name) {
        [] => Ok(None),
        [only] => Ok(Some(std::mem::take(only))),
        _ => Err(bad(name)),
    };
    let site = one("Sec-Fetch-Site")?;
    let is_foreign = site.is_some_and(|site| site == "cross-site" || site == "same-site");
    // A link to the page may stand anywhere, such as in a terminal that is a page itself.
    let follows_link = one("Sec-Fetch-Mode")?.is_some_and(|mode| mode == "navigate");
    Ok(Request {
        is_get: parsed.method == Some("GET"),
        path: path.to_owned(),
        token: token.unwrap_or_default().to_owned(),
        host: one("Host")?.unwrap_or_default(),
        origin: one("Origin")?,
        is_foreign: is_foreign && !follows_link,
        key: one("Sec-WebSocket-Key")?,
    })
}

fn answer(stream: &mut TcpStream, status: &str, kind: &str, body: &str) -> Result<()> {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\
         Connection: close\r\nCache-Control: no-store\r\nReferrer-Policy: no-referrer\r\n\
         X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; \
         style-src 'unsafe-inline'; img-src blob: data:; connect-src 'self'; \
         frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body.as_bytes())?;
    stream.flush()?;
    stream.shutdown(std::net::Shutdown::Write)
}

/// The half of a connection that is read. What the protocol would answer by itself goes through the
/// page's outbox, since two threads must not write.
struct Ear(TcpStream);

impl Read for Ear {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for Ear {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Serves a page until it is closed.
fn talk(mut stream: TcpStream, key: &str, shared: &Arc<Shared>) -> Result<()> {
    let accepted = derive_accept_key(key.as_bytes());
    let head = format!(
        "HTTP/1.1 101 Switching Protocols\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Accept: {accepted}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.set_read_timeout(None)?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MOST_MESSAGE))
        .max_frame_size(Some(MOST_MESSAGE));
    let ear = Ear(stream.try_clone()?);
    let mut ear = WebSocket::from_raw_socket(ear, Role::Server, Some(config));
    let end = stream.try_clone()?;
    let mut mouth = WebSocket::from_raw_socket(stream, Role::Server, None);
    let page = Arc::new(Page::default());
    shared.enter(&page);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while let Some(letters) = page.outbox.take() {
                let sent = letters.into_iter().try_for_each(|letter| {
                    mouth.write(match letter {
                        Letter::Text(text) => Message::text(text),
                        Letter::Bytes(bytes) => Message::binary(bytes),
                        Letter::Pong(bytes) => Message::Pong(bytes.into()),
                    })
                });
                if sent.and_then(|()| mouth.flush()).is_err() {
                    break;
                }
            }
            // Wakes the reader where it is the writer that has failed.
            let _ = end.shutdown(std::net::Shutdown::Both);
        });
        scope.spawn(|| page.render(shared));
        loop {
            match ear.read() {
                Ok(Message::Text(text)) => page.hear(&text, shared),
                Ok(Message::Ping(bytes)) => page.outbox.pong(bytes.to_vec()),
                Ok(Message::Close(_)) | Err(_) => break,
                Ok(_) => (),
            }
        }
        page.close();
    });
    let mut pages = locked(&shared.pages);
    pages.retain(|other| other.strong_count() > 0 && !std::ptr::eq(other.as_ptr(), &*page));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(host: &str, origin: Option<&str>, token: &str) -> Request {
        Request {
            is_get: true,
            path: "/".into(),
            token: token.into(),
            host: host.into(),
            origin: origin.map(Into::into),
            is_foreign: false,
            key: None,
        }
    }

    #[test]
    fn only_this_machine_with_the_token_is_let_in() {
        let guard = Guard::new("127.0.0.1:8123".parse().unwrap());
        let token = guard.token.clone();
        assert_eq!(token.len(), 32);
        assert_ne!(token, Guard::new(guard.address).token);
        let refused = |host: &str, origin: Option<&str>, token: &str| {
            guard.refuse(&request(host, origin, token)).is_some()
        };
        for host in [
            "127.0.0.1:8123",
            "localhost:9000",
            "LOCALHOST",
            "[::1]:8123",
        ] {
            assert!(!refused(host, None, &token), "{host}");
            assert!(
                !refused(host, Some(&format!("http://{host}")), &token),
                "{host}"
            );
            assert!(refused(host, Some("http://evil.example"), &token), "{host}");
            assert!(refused(host, Some("null"), &token), "{host}");
            assert!(refused(host, None, ""), "{host}");
            assert!(refused(host, None, &token[1..]), "{host}");
        }
        for host in [
            "evil.example",
            "127.0.0.1.evil.example:8123",
            "10.0.0.1:8123",
            "",
        ] {
            assert!(refused(host, None, &token), "{host}");
        }
        let open = Guard::new("0.0.0.0:8123".parse().unwrap());
        assert!(
            open.refuse(&request("10.0.0.1:8123", None, &open.token))
                .is_none()
        );
        assert!(
            open.refuse(&request("evil.example:8123", None, &open.token))
                .is_some()
        );
    }
}
