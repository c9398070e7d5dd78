//! [`PortNode`]: membership of one thread in a run.
//!
//! The iceoryx2 configuration is built from the run directory alone (root path, prefix); the
//! ambient configuration files that iceoryx2 would otherwise look for in the working directory and
//! in the home directory are never read. Signal handling stays with the program. Joining happens
//! in a helper thread under a time limit, because a damaged management segment makes the node
//! builder poll for ever.

use super::PortError;
use crate::names::{LAYOUT_ATTRIBUTE, layout_text, service_name};
use crate::run::RunDir;
use crate::wire::Message;
use iceoryx2::prelude::{
    AttributeSpecifier, AttributeVerifier, Config, FileName, LogLevel, Node, NodeBuilder, NodeName, Path,
    SemanticString, ServiceName, SignalHandlingMode, ipc, set_log_level_from_env_or,
};
use std::fmt::Debug;
use std::rc::Rc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

const JOIN_LIMIT: Duration = Duration::from_secs(2);
const OPEN_ATTEMPTS: usize = 3;
const OPEN_PAUSE: Duration = Duration::from_millis(50);

/// Membership in a run. Join in the thread that uses the ports; clones are the same membership.
#[derive(Clone, Debug)]
pub struct PortNode {
    node: Rc<Node<ipc::Service>>,
    /// Keeps the run's files from being removed while this process uses them.
    _run: RunDir,
}

impl PortNode {
    /// Joins the run. `name` shows up in diagnosis tools.
    ///
    /// # Errors
    /// [`PortError::JoinTimeout`] after two seconds, [`PortError::Join`] or [`PortError::Path`].
    pub fn join(run: &RunDir, name: &str) -> Result<Self, PortError> {
        set_log_level_from_env_or(LogLevel::Fatal);
        let config = config(run)?;
        let node_name = NodeName::new(name).map_err(|e| join_error(&e))?;
        let (sender, receiver) = sync_channel(1);
        let held = run.clone();
        let builder = move || {
            let node = NodeBuilder::new()
                .name(&node_name)
                .config(&config)
                .signal_handling_mode(SignalHandlingMode::Disabled)
                .create::<ipc::Service>();
            // The receiver is gone only after the time limit; then the node is dropped here.
            drop(sender.send(node));
            // Until here nobody may remove the run's files.
            drop(held);
        };
        std::thread::Builder::new().name("join-run".to_owned()).spawn(builder).map_err(|e| join_error(&e))?;
        match receiver.recv_timeout(JOIN_LIMIT) {
            Ok(Ok(node)) => Ok(Self { node: Rc::new(node), _run: run.clone() }),
            Ok(Err(error)) => Err(join_error(&error)),
            Err(RecvTimeoutError::Timeout) => Err(PortError::JoinTimeout { seconds: JOIN_LIMIT.as_secs() }),
            Err(RecvTimeoutError::Disconnected) => Err(join_error(&"the joining thread panicked")),
        }
    }

    /// Removes what dead processes of this run left behind and returns how many there were. A
    /// long-running process calls this about once a second, never from the servo thread.
    pub fn clean_up_dead(&self) -> u64 {
        self.node.try_cleanup_dead_nodes().cleanups
    }

    pub(super) fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }
}

fn join_error(reason: &impl Debug) -> PortError {
    PortError::Join { reason: format!("{reason:?}") }
}

fn config(run: &RunDir) -> Result<Config, PortError> {
    let path = run.path();
    let refuse = |reason| PortError::Path { path: path.display().to_string(), reason };
    let text = path.to_str().ok_or_else(|| refuse("it is not UTF-8"))?;
    let root = Path::new(text.as_bytes()).map_err(|_| refuse("it is too long"))?;
    let prefix = FileName::new(run.prefix().as_bytes()).map_err(|_| refuse("its prefix is no file name"))?;
    let mut config = Config::default();
    config.global.set_root_path(&root);
    config.global.prefix = prefix;
    Ok(config)
}

pub(super) fn name_of<M: Message>() -> Result<ServiceName, PortError> {
    ServiceName::new(&service_name::<M>()).map_err(|e| open_error(M::NAME, &e))
}

/// Demands that the peer's messages have our layout.
pub(super) fn required_layout<M: Message>() -> Result<AttributeVerifier, PortError> {
    let (key, value) = layout_attribute::<M>()?;
    AttributeVerifier::new().require(&key, &value).map_err(|e| open_error(M::NAME, &e))
}

/// States our layout.
pub(super) fn stated_layout<M: Message>() -> Result<AttributeSpecifier, PortError> {
    let (key, value) = layout_attribute::<M>()?;
    AttributeSpecifier::new().define(&key, &value).map_err(|e| open_error(M::NAME, &e))
}

type Attribute = (iceoryx2::service::attribute::AttributeKey, iceoryx2::service::attribute::AttributeValue);

fn layout_attribute<M: Message>() -> Result<Attribute, PortError> {
    let key = LAYOUT_ATTRIBUTE.try_into().map_err(|e| open_error(M::NAME, &e))?;
    let value = layout_text::<M>().as_str().try_into().map_err(|e| open_error(M::NAME, &e))?;
    Ok((key, value))
}

pub(super) fn open_error(topic: &'static str, reason: &impl Debug) -> PortError {
    PortError::Open { topic, reason: format!("{reason:?}") }
}

pub(super) fn incompatible<M: Message>() -> PortError {
    PortError::Incompatible { topic: M::NAME, layout: layout_text::<M>() }
}

/// Repeats an attempt: while a dead process's remains are being removed by another process,
/// opening a service fails for some milliseconds. Refusals that waiting cannot mend are final.
pub(super) fn retried<T>(mut attempt: impl FnMut() -> Result<T, PortError>) -> Result<T, PortError> {
    let mut outcome = attempt();
    for _ in 1..OPEN_ATTEMPTS {
        if !matches!(outcome, Err(PortError::Open { .. } | PortError::Full { .. })) {
            break;
        }
        std::thread::sleep(OPEN_PAUSE);
        outcome = attempt();
    }
    outcome
}
