//! YAML documents whose keys keep the order in which they are given.

use serde::ser::{Serialize, SerializeMap, Serializer};

/// A YAML value.
pub enum Node {
    Text(String),
    /// Text as a literal block, which people can read line by line.
    Block(String),
    Number(u64),
    List(Vec<Node>),
    Map(Vec<(&'static str, Node)>),
}

impl From<&str> for Node {
    fn from(text: &str) -> Node {
        Node::Text(text.into())
    }
}

impl From<String> for Node {
    fn from(text: String) -> Node {
        Node::Text(text)
    }
}

impl From<u32> for Node {
    fn from(number: u32) -> Node {
        Node::Number(number.into())
    }
}

/// Converts `items` to a list.
pub fn list<T: Into<Node>>(items: impl IntoIterator<Item = T>) -> Node {
    Node::List(items.into_iter().map(Into::into).collect())
}

impl Serialize for Node {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Node::Text(text) => serializer.serialize_str(text),
            Node::Block(text) => serde_saphyr::LitStr(text).serialize(serializer),
            Node::Number(number) => serializer.serialize_u64(*number),
            Node::List(items) => serializer.collect_seq(items),
            Node::Map(entries) => {
                let mut map = serializer.serialize_map(Some(entries.len()))?;
                for (key, value) in entries {
                    map.serialize_entry(key, value)?;
                }
                map.end()
            }
        }
    }
}

/// Writes a document: comment lines, then a map of `entries`.
pub fn document(comments: &[String], entries: Vec<(&'static str, Node)>) -> String {
    let mut text: String = comments.iter().map(|line| format!("# {line}\n")).collect();
    // Long arguments stay on one line, because folded ones are hard to read.
    let options = serde_saphyr::ser_options! { prefer_block_scalars: false };
    serde_saphyr::to_fmt_writer_with_options(&mut text, &Node::Map(entries), options)
        .expect("a tree of text and numbers is valid YAML");
    text
}
